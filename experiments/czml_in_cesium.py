"""A fit's CZML as Cesium itself reads it: attitude and position against the CSV of the same export, and a picture.

Needs Chromium, playwright and an unpacked Cesium, which the project does not ship:

npm pack cesium && tar xzf cesium-*.tgz
.venv/bin/jaxsat export munin-fit --format czml --format csv --frame gcrf --out out/export
.venv/bin/python experiments/czml_in_cesium.py out/export --cesium package/Build/CesiumUnminified --out out/cesium.png
"""

import argparse
import csv
import http.server
import shutil
import threading
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright
from scipy.spatial.transform import Rotation

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PAGE = """<!doctype html><meta charset="utf-8"><link rel="stylesheet" href="/Widgets/widgets.css">
<style>html, body, #view {margin: 0; width: 100%; height: 100%}</style><div id="view"></div>
<script>window.CESIUM_BASE_URL = "/"</script><script src="/Cesium.js"></script><script>
window.read = async seconds => {
  const viewer = new Cesium.Viewer("view", {baseLayer: false, baseLayerPicker: false, geocoder: false});
  const source = await Cesium.CzmlDataSource.load("/session.czml");
  await viewer.dataSources.add(source);
  const clock = source.clock, entity = source.entities.values.find(e => e.position && e.orientation);
  const span = new Cesium.TimeInterval({start: clock.startTime, stop: clock.stopTime});
  await Cesium.Transforms.preloadIcrfFixed(span);
  const found = seconds.map(s => {
    const t = Cesium.JulianDate.addSeconds(clock.startTime, s, new Cesium.JulianDate());
    const r = entity.position.getValueInReferenceFrame(t, Cesium.ReferenceFrame.INERTIAL);
    const fixed = Cesium.Matrix3.fromQuaternion(entity.orientation.getValue(t));
    const icrf = Cesium.Transforms.computeFixedToIcrfMatrix(t);
    const axes = Cesium.Matrix3.multiply(icrf, fixed, new Cesium.Matrix3());
    return {position: [r.x, r.y, r.z], columns: Cesium.Matrix3.toArray(axes)};
  });
  await viewer.zoomTo(source);
  return found;
};</script>"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("export", type=Path)
    parser.add_argument("--cesium", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("out/cesium.png"))
    arguments = parser.parse_args()
    with (arguments.export / "session.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    t = [float(row["t_s"]) for row in rows]
    found = in_cesium(arguments.cesium, arguments.export / "session.czml", t, arguments.out)
    ours = Rotation.from_quat([[float(row[f"q_{c}"]) for c in "wxyz"] for row in rows], scalar_first=True)
    # Cesium keeps matrices column by column.
    theirs = Rotation.from_matrix(np.array([f["columns"] for f in found]).reshape(-1, 3, 3).transpose(0, 2, 1))
    places = np.array([[1e3 * float(row[f"position_{c}_km"]) for c in "xyz"] for row in rows])
    apart = np.abs(np.array([f["position"] for f in found]) - places)
    angle = np.degrees((theirs.inv() * ours).magnitude())
    print(f"{len(t)} samples in Cesium: attitude within {angle.max():.1e} deg, position within {apart.max():.1e} m")


def in_cesium(cesium: Path, czml: Path, t: list[float], picture: Path) -> list[dict]:
    """What Cesium makes of the file at `t` [s after its start], ICRF; leaves a screenshot in `picture`."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *args):
            super().__init__(*args, directory=str(cesium))

        def translate_path(self, path):
            return str(czml) if path == "/session.czml" else super().translate_path(path)

        def log_message(self, *args):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    browser_path = next(filter(None, map(shutil.which, NAMES)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=FLAGS)
        page = browser.new_page(viewport={"width": 1000, "height": 700})
        page.set_default_timeout(120e3)
        address = f"http://127.0.0.1:{server.server_port}/"
        page.route(address + "page", lambda route: route.fulfill(body=PAGE, content_type="text/html"))
        page.goto(address + "page")
        found = page.evaluate("seconds => read(seconds)", t)
        page.wait_for_timeout(3000)
        picture.parent.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=str(picture))
        browser.close()
    server.shutdown()
    return found


if __name__ == "__main__":
    main()
