// The Earth: land and sea, day and night, graticule, equator, meridians of Greenwich and of the Sun. Radius 1, z north.
import { CanvasTexture, Group, Mesh, NoColorSpace, ShaderMaterial, SphereGeometry, Vector3 } from "three";
import { landRings } from "./coastline.js";
import { Line } from "./marks3d.js";

const [WIDTH, HEIGHT] = [2048, 1024];
const ABOVE = 1.004;

const VERTEX = `
varying vec2 place;
varying vec3 outward;
varying vec3 seen;
void main() {
  place = uv;
  outward = normalize(mat3(modelMatrix) * normal);
  vec4 world = modelMatrix * vec4(position, 1.0);
  seen = normalize(cameraPosition - world.xyz);
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

// The terminator is as wide as the Sun is high in twilight, 6 deg, on the night's side.
const FRAGMENT = `
uniform sampler2D map;
uniform vec3 sun;
uniform vec3 night;
varying vec2 place;
varying vec3 outward;
varying vec3 seen;
void main() {
  vec3 day = texture2D(map, place).rgb;
  float up = dot(normalize(outward), sun);
  float light = smoothstep(-0.1, 0.02, up);
  vec3 lit = day * (0.86 + 0.14 * max(up, 0.0));
  vec3 dark = mix(night, day * night * 1.6, 0.55);
  float rim = pow(1.0 - max(dot(normalize(outward), normalize(seen)), 0.0), 3.0);
  gl_FragColor = vec4(mix(dark, lit, light) + rim * mix(0.05, 0.16, light), 1.0);
}`;

export class Earth extends Group {
  constructor(theme) {
    super();
    this.texture = new CanvasTexture(document.createElement("canvas"));
    this.texture.colorSpace = NoColorSpace;
    this.texture.anisotropy = 8;
    this.material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { map: { value: this.texture }, sun: { value: new Vector3(1, 0, 0) }, night: { value: new Vector3() } },
    });
    const ball = new Mesh(new SphereGeometry(1, 96, 64), this.material);
    // The sphere's own axis is y.
    ball.rotation.x = Math.PI / 2;
    this.turning = new Group();
    this.equator = new Line(circle((a) => [Math.cos(a), Math.sin(a), 0], 0, 2 * Math.PI), { width: 2 });
    this.greenwich = new Line(meridian(), { width: 2.2 });
    this.sunMeridian = new Line(meridian(), { width: 2.2 });
    this.turning.add(ball, this.equator, this.greenwich);
    this.add(this.turning, this.sunMeridian);
    theme.onChange(() => this.paint(theme));
  }

  set(greenwich, sun) {
    this.turning.rotation.z = greenwich;
    this.sunMeridian.rotation.z = Math.atan2(sun.y, sun.x);
    this.material.uniforms.sun.value.copy(sun);
  }

  paint(theme) {
    drawMap(this.texture.image, theme);
    this.texture.needsUpdate = true;
    this.material.uniforms.night.value.set(...rgb(theme.colour("night")));
    this.equator.paint(theme.colour("equator"));
    this.greenwich.paint(theme.colour("greenwich"));
    this.sunMeridian.paint(theme.colour("sun"));
  }
}

function rgb(text) {
  return text.match(/[\d.]+/g).slice(0, 3).map((x) => Number(x) / 255);
}

function circle(point, from, to, steps = 120) {
  const angles = Array.from({ length: steps + 1 }, (_, i) => from + ((to - from) * i) / steps);
  return angles.flatMap((a) => point(a).map((x) => ABOVE * x));
}

function meridian() {
  return circle((a) => [Math.cos(a), 0, Math.sin(a)], -Math.PI / 2, Math.PI / 2);
}

function drawMap(canvas, theme) {
  canvas.width = WIDTH;
  canvas.height = HEIGHT;
  const context = canvas.getContext("2d");
  const x = (longitude) => ((longitude + 180) / 360) * WIDTH;
  const y = (latitude) => ((90 - latitude) / 180) * HEIGHT;
  context.fillStyle = theme.colour("sea");
  context.fillRect(0, 0, WIDTH, HEIGHT);
  const [ground, coast] = [new Path2D(), new Path2D()];
  for (const ring of landRings()) {
    for (const shift of [-WIDTH, 0, WIDTH]) {
      const points = ring.map(([longitude, latitude]) => [x(longitude) + shift, y(latitude)]);
      trace(coast, points);
      // A ring that goes round the Earth holds its south pole.
      if (Math.abs(ring.at(-1)[0] - ring[0][0]) > 180) {
        points.push([points.at(-1)[0], HEIGHT], [points[0][0], HEIGHT]);
      }
      trace(ground, points);
      ground.closePath();
    }
  }
  context.fillStyle = theme.colour("land");
  context.fill(ground, "evenodd");
  context.strokeStyle = theme.colour("coast");
  context.lineWidth = 2;
  context.stroke(coast);
  context.strokeStyle = theme.colour("graticule");
  context.lineWidth = 1.2;
  context.beginPath();
  for (let longitude = -180; longitude < 180; longitude += 15) {
    context.moveTo(x(longitude), y(75));
    context.lineTo(x(longitude), y(-75));
  }
  for (let latitude = -75; latitude <= 75; latitude += 15) {
    context.moveTo(0, y(latitude));
    context.lineTo(WIDTH, y(latitude));
  }
  context.stroke();
}

function trace(path, points) {
  points.forEach(([x, y], i) => (i ? path.lineTo(x, y) : path.moveTo(x, y)));
}
