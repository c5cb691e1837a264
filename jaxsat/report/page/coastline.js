// The land as rings of longitude and latitude [deg], unbroken at the date line, from Natural Earth's 1:110m (public domain).
import land from "world-atlas/land-110m.json";

export function landRings() {
  const { scale, translate } = land.transform;
  const arcs = land.arcs.map((arc) => {
    let [x, y] = [0, 0];
    return arc.map(([dx, dy]) => [(x += dx) * scale[0] + translate[0], (y += dy) * scale[1] + translate[1]]);
  });
  // A negative number ~i stands for arc i walked backwards; the first point of an arc is the last of the one before.
  const ring = (numbers) =>
    numbers.flatMap((i, k) => (i < 0 ? arcs[~i].toReversed() : arcs[i]).slice(k === 0 ? 0 : 1));
  const rings = [];
  const walk = (geometry) => {
    if (geometry.type === "GeometryCollection") geometry.geometries.forEach(walk);
    else if (geometry.type === "Polygon") rings.push(...geometry.arcs.map(ring));
    else rings.push(...geometry.arcs.flatMap((polygon) => polygon.map(ring)));
  };
  walk(land.objects.land);
  return rings.map(unbroken);
}

// Longitudes run on past 180 deg instead of jumping back.
function unbroken(ring) {
  let before = ring[0][0];
  return ring.map(([longitude, latitude]) => {
    before = longitude + 360 * Math.round((before - longitude) / 360);
    return [before, latitude];
  });
}
