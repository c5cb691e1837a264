// The page's numbers as they stand in its data block, and how to find a place in a rising list.
export function readPage(text) {
  const page = JSON.parse(text);
  const { samples } = page;
  page.epochMs = Date.parse(`${page.epoch_utc}Z`);
  page.shadow_s = page.scene ? page.scene.shadow_s : darkSpans(samples.t_s, samples.lit);
  return page;
}

// Index i with list[i] <= x < list[i + 1], kept inside the list's intervals.
export function interval(list, x) {
  let low = 0;
  let high = list.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (list[middle] <= x) low = middle;
    else high = middle;
  }
  return low;
}

export function nearest(list, x) {
  const i = interval(list, x);
  return i + 1 < list.length && x - list[i] > list[i + 1] - x ? i + 1 : i;
}

// What the shaded stretches of charts mean: kind and name, of those that there are.
export function shades({ held_s, shadow_s }) {
  return [...(held_s.length ? [["held", "held out"]] : []), ...(shadow_s.length ? [["shaded", "Earth’s shadow"]] : [])];
}

// Without a scene the shadow is known at samples only: its edges lie half-way between two.
function darkSpans(t, lit) {
  const spans = [];
  lit.forEach((on, i) => {
    if (on) return;
    const begin = i > 0 ? (t[i - 1] + t[i]) / 2 : t[i];
    const end = i + 1 < t.length ? (t[i] + t[i + 1]) / 2 : t[i];
    if (spans.length && spans.at(-1)[1] === begin) spans.at(-1)[1] = end;
    else spans.push([begin, end]);
  });
  return spans;
}
