// Numbers and instants as people read them.
export function fixed(value, digits, unit = "") {
  if (value == null || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits).replace(/^-(0(\.0+)?)$/, "$1").replace("-", "−");
  return unit ? `${text} ${unit}` : text;
}

export function signed(value, digits) {
  return value > 0 ? `+${fixed(value, digits)}` : fixed(value, digits);
}

// With so many significant digits; powers of ten where plain digits would be many zeros.
export function short(value, count = 4) {
  if (value == null || !Number.isFinite(value)) return "–";
  const power = value === 0 ? 0 : Math.floor(Math.log10(Math.abs(value)));
  if (power < -4 || power > 6) return value.toExponential(count - 1).replaceAll("-", "−");
  return fixed(value, Math.max(0, count - 1 - power));
}

// Of a turn at one instant `t` is its angle.
export function utc(page, t) {
  return new Date(page.epochMs + 1000 * (page.turn?.t_s ?? t)).toISOString();
}

export function clockText(page, t) {
  if (page.turn) return `turned ${fixed(t, 0)}°, ${utc(page, t).slice(11, 19)} UTC`;
  const since = `t = ${fixed(t, 0)} s`;
  return Number.isFinite(page.epochMs) ? `${since}, ${utc(page, t).slice(11, 19)} UTC` : since;
}
