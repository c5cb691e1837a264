// The one time of the page: whoever shows something of it subscribes, whoever changes it seeks.
import { interval, nearest } from "./data.js";

const SECONDS_FOR_ALL = 60;
const STILL_STEP_MS = 500;

export class Clock {
  constructor(page) {
    this.samples = page.samples.t_s;
    this.begin = this.samples[0];
    this.end = this.samples.at(-1);
    this.t = this.begin;
    this.playing = false;
    this.speed = niceSpeed((this.end - this.begin) / SECONDS_FOR_ALL);
    this.listeners = [];
  }

  onChange(listener) {
    this.listeners.push(listener);
    listener(this);
  }

  tell() {
    for (const listener of this.listeners) listener(this);
  }

  seek(t) {
    this.t = Math.min(Math.max(t, this.begin), this.end);
    this.tell();
  }

  // To the sample `count` further on; between two samples the first step goes to the next one.
  step(count) {
    const here = interval(this.samples, this.t);
    const last = this.samples.length - 1;
    const from = this.t >= this.end ? last : here;
    const between = this.t > this.samples[from];
    const to = from + count + (between && count < 0 ? 1 : 0);
    this.seek(this.samples[Math.min(Math.max(to, 0), last)]);
  }

  sample() {
    return nearest(this.samples, this.t);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  pause() {
    this.playing = false;
    this.tell();
  }

  play() {
    if (this.playing) return;
    if (this.t >= this.end) this.t = this.begin;
    this.playing = true;
    this.tell();
    // Whoever asked for less motion gets samples one after the other, not a film.
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    let before = null;
    const frame = (now) => {
      if (!this.playing) return;
      before ??= now;
      if (still && now - before < STILL_STEP_MS) return void requestAnimationFrame(frame);
      if (still) this.step(1);
      // A tab that slept must not jump.
      else this.seek(this.t + (this.speed * Math.min(now - before, 100)) / 1000);
      before = now;
      if (this.t >= this.end) this.pause();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
}

function niceSpeed(value) {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1)));
  return power * [1, 2, 5, 10].find((step) => step * power >= value * 0.999);
}
