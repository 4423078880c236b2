// A curve over time. In: arrays of seconds and values. Out: a drawing on a canvas with the largest value and both ends of the time.
function yfPlot(canvas, times, values, color, mark) {
  'use strict';
  const ratio = devicePixelRatio || 1, [w, h] = [canvas.clientWidth, canvas.clientHeight];
  if (!w || !h) return;
  [canvas.width, canvas.height] = [w * ratio, h * ratio];
  const g = canvas.getContext('2d'), style = getComputedStyle(document.documentElement);
  const ink = (name) => style.getPropertyValue(name).trim();
  g.scale(ratio, ratio);
  g.font = '10px system-ui,sans-serif';
  const [left, bottom, count] = [44, 14, times.length];
  let [high, first, last] = [0, Infinity, -Infinity];
  for (let i = 0; i < count; i++) {
    if (isFinite(values[i])) high = Math.max(high, values[i]);
    [first, last] = [Math.min(first, times[i]), Math.max(last, times[i])];
  }
  const raw = high || 1, power = 10 ** Math.floor(Math.log10(raw));
  const round = [1, 2, 2.5, 5, 10].find((f) => f * power >= raw) * power;
  const x = (t) => left + ((w - left - 6) * (t - first)) / Math.max(last - first, 1e-9);
  const y = (v) => h - bottom - ((h - bottom - 8) * v) / round;
  const text = (v) => (v >= 100 || v === 0 ? v.toFixed(0) : v.toPrecision(2));
  g.strokeStyle = ink('--line');
  g.fillStyle = ink('--soft');
  g.textAlign = 'right';
  for (const v of [0, round / 2, round]) {
    g.beginPath(); g.moveTo(left, y(v)); g.lineTo(w - 6, y(v)); g.stroke();
    g.fillText(text(v), left - 4, y(v) + 3);
  }
  if (!count) return;
  g.fillText(last.toFixed(1) + ' s', w - 6, h - 2);
  g.textAlign = 'left';
  g.fillText(first.toFixed(1) + ' s', left, h - 2);
  g.strokeStyle = ink(color);
  g.lineWidth = 1.3;
  g.beginPath();
  let down = false;
  for (let i = 0; i < count; i++) {
    if (!isFinite(values[i])) { down = false; continue; }
    down ? g.lineTo(x(times[i]), y(values[i])) : g.moveTo(x(times[i]), y(values[i]));
    down = true;
  }
  g.stroke();
  if (mark !== null) { g.strokeStyle = ink('--ink'); g.beginPath(); g.moveTo(x(mark), 4); g.lineTo(x(mark), h - bottom); g.stroke(); }
}
