// Where everything is at any time of the arc: read from the scene's tables, nothing is propagated here.
import { Quaternion, Vector3 } from "three";
import { interval, nearest } from "./data.js";

const DEGREE = Math.PI / 180;

export class Motion {
  constructor(page) {
    this.page = page;
    this.scene = page.scene;
    this.radius_km = this.scene.earth.radius_km;
    this.track = this.scene.track;
    this.step = (this.scene.end_s - this.scene.begin_s) / (this.track.position_km.length - 1);
  }

  // Index before t in a table of `count` rows over the arc, and the share of the interval gone by.
  place(t, count) {
    const x = ((t - this.scene.begin_s) / (this.scene.end_s - this.scene.begin_s)) * (count - 1);
    const i = Math.min(Math.max(Math.floor(x), 0), count - 2);
    return [i, Math.min(Math.max(x - i, 0), 1)];
  }

  mix(table, t) {
    const [i, s] = this.place(t, table.length);
    return new Vector3(...table[i]).lerp(new Vector3(...table[i + 1]), s);
  }

  // Cubic through positions and velocities: a kilometre over steps of a tenth of a revolution.
  position(t) {
    const { position_km: r, velocity_km_s: v } = this.track;
    const [i, s] = this.place(t, r.length);
    const s2 = s * s;
    const s3 = s2 * s;
    return new Vector3()
      .addScaledVector(new Vector3(...r[i]), 2 * s3 - 3 * s2 + 1)
      .addScaledVector(new Vector3(...v[i]), (s3 - 2 * s2 + s) * this.step)
      .addScaledVector(new Vector3(...r[i + 1]), 3 * s2 - 2 * s3)
      .addScaledVector(new Vector3(...v[i + 1]), (s3 - s2) * this.step);
  }

  velocity(t) {
    return this.mix(this.track.velocity_km_s, t);
  }

  field(t) {
    return this.mix(this.track.field_uT, t);
  }

  sun(t) {
    return this.mix(this.scene.sun_eci, t).normalize();
  }

  // Turns body axes into inertial ones.
  attitude(t) {
    const { t_s, quaternion_inertial_from_body: q } = this.scene.attitude;
    const i = interval(t_s, t);
    const [a, b] = [q[i], q[Math.min(i + 1, q.length - 1)]].map(([w, x, y, z]) => new Quaternion(x, y, z, w).normalize());
    const span = t_s[Math.min(i + 1, q.length - 1)] - t_s[i];
    return a.slerp(b, span > 0 ? Math.min(Math.max((t - t_s[i]) / span, 0), 1) : 0);
  }

  greenwich(t) {
    const { greenwich_angle_rad, rotation_rate_rad_s } = this.scene.earth;
    return greenwich_angle_rad + rotation_rate_rad_s * t;
  }

  inShadow(t) {
    return this.scene.shadow_s.some(([begin, end]) => t >= begin && t < end);
  }

  // The field line through the satellite as x, y, z after each other, or null.
  fieldLine(t) {
    const lines = this.scene.field_lines_km;
    if (!lines) return null;
    const [i, s] = this.place(t, lines.length);
    return lines[i].map((x, k) => x + s * (lines[i + 1][k] - x));
  }

  // Of the satellite, geocentric [deg], and its height over the sphere of the computation [km].
  groundPoint(t) {
    const r = this.position(t);
    const distance = r.length();
    const longitude = (Math.atan2(r.y, r.x) - this.greenwich(t)) / DEGREE;
    return {
      latitude: Math.asin(r.z / distance) / DEGREE,
      longitude: ((((longitude + 180) % 360) + 360) % 360) - 180,
      height: distance - this.radius_km,
    };
  }

  fieldAngle(t) {
    const x = new Vector3(1, 0, 0).applyQuaternion(this.attitude(t));
    return x.angleTo(this.field(t)) / DEGREE;
  }

  rate(t) {
    const { samples } = this.page;
    return Math.hypot(...samples.rate_deg_s[nearest(samples.t_s, t)]);
  }

  plain(t) {
    const { x, y, z, w } = this.attitude(t);
    return {
      position_km: this.position(t).toArray(),
      quaternion_inertial_from_body: [w, x, y, z],
      sun_eci: this.sun(t).toArray(),
      field_angle_deg: this.fieldAngle(t),
      in_shadow: this.inShadow(t),
    };
  }
}
