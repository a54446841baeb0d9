"use strict";
// Draws on canvases what page.js has: curves of least and largest values over time, levels of inputs, and the
// sensitivity of a shaper over frequency. Colours come from the style sheet, so that dark pages are dark.

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// A canvas as sharp as the screen, cleared, with its size in pixels of the page.
function cleared(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const sharp = window.devicePixelRatio || 1;
  const [across, down] = [Math.round(width * sharp), Math.round(height * sharp)];
  if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
  const pen = canvas.getContext("2d");
  pen.setTransform(sharp, 0, 0, sharp, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  pen.lineJoin = "round";
  return { pen, width, height };
}

// A round step with about `count` of them in `span`.
function step(span, count) {
  const raw = span / count;
  const decade = 10 ** Math.floor(Math.log10(raw));
  return decade * [1, 2, 5, 10].find((factor) => factor * decade >= raw);
}

function grid({ pen }, frame, ticks, place, words, vertical) {
  pen.strokeStyle = colour("grid");
  pen.fillStyle = colour("quiet");
  pen.lineWidth = 1;
  pen.textAlign = vertical ? "center" : "right";
  pen.textBaseline = vertical ? "top" : "middle";
  for (const tick of ticks) {
    const at = Math.round(place(tick)) + 0.5;
    pen.beginPath();
    if (vertical) {
      pen.moveTo(at, frame.top);
      pen.lineTo(at, frame.bottom);
      pen.fillText(words(tick), at, frame.bottom + 5);
    } else {
      pen.moveTo(frame.left, at);
      pen.lineTo(frame.right, at);
      pen.fillText(words(tick), frame.left - 6, at);
    }
    pen.stroke();
  }
}

const LEFT = 58;
const RIGHT = 18;

// Spans are { second, command: [least, largest], ... } in millimetres, the newest last; a gap between two of
// them is not bridged.
function drawTimes(canvas, spans, newest, seconds, gap) {
  const sheet = cleared(canvas);
  const { pen, width, height } = sheet;
  const frame = { left: LEFT, top: 8, right: width - RIGHT, bottom: height - 24 };
  const shown = spans.filter((span) => span.second >= newest - seconds);
  let [low, high] = [Infinity, -Infinity];
  for (const span of shown) {
    for (const name of ["command", "setpoint", "encoder"]) {
      if (!span[name]) continue;
      low = Math.min(low, span[name][0]);
      high = Math.max(high, span[name][1]);
    }
  }
  if (!(low <= high)) [low, high] = [-1, 1];
  const margin = Math.max(0.08 * (high - low), 0.05);
  [low, high] = [low - margin, high + margin];
  const x = (second) => frame.right - ((newest - second) / seconds) * (frame.right - frame.left);
  const y = (mm) => frame.bottom - ((mm - low) / (high - low)) * (frame.bottom - frame.top);
  const apart = step(high - low, 5);
  const levels = [];
  for (let level = Math.ceil(low / apart); level * apart <= high; level += 1) levels.push(level * apart);
  const decimals = Math.max(0, -Math.floor(Math.log10(apart)));
  grid(sheet, frame, levels, y, (level) => `${level.toFixed(decimals)}`, false);
  const every = step(seconds, width < 500 ? 4 : 10);
  const ages = [];
  for (let age = 0; age <= seconds; age += every) ages.push(-age);
  grid(sheet, frame, ages, (age) => x(newest + age), (age) => (age ? `${age} s` : "now"), true);
  pen.fillStyle = colour("quiet");
  pen.textAlign = "left";
  pen.textBaseline = "top";
  pen.fillText("mm", frame.left + 5, frame.top);
  pen.save();
  pen.beginPath();
  pen.rect(frame.left, frame.top, frame.right - frame.left, frame.bottom - frame.top);
  pen.clip();
  for (const [name, dash, thick] of [["encoder", [], 1.5], ["command", [6, 4], 1.5], ["setpoint", [], 2]]) {
    pen.strokeStyle = colour(name);
    pen.setLineDash(dash);
    pen.lineWidth = thick;
    pen.beginPath();
    let before = null;
    for (const span of shown) {
      if (!span[name]) continue;
      const [least, largest] = span[name];
      const at = x(span.second);
      const follows = before !== null && span.second - before < gap;
      if (follows) pen.lineTo(at, y(least));
      else pen.moveTo(at, y(least));
      if (largest !== least) pen.lineTo(at, y(largest));
      before = span.second;
    }
    pen.stroke();
  }
  pen.restore();
}

// Levels of three inputs: a bar where an input was high, paler where it was high for a part of the span.
function drawInputs(canvas, spans, newest, seconds, length) {
  const { pen, width, height } = cleared(canvas);
  const frame = { left: LEFT, right: width - RIGHT };
  const scale = (frame.right - frame.left) / seconds;
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (let place = 0; place < 3; place += 1) {
    const middle = (height * (place + 0.5)) / 3;
    pen.fillStyle = colour("quiet");
    pen.fillText(`input ${place + 1}`, frame.left - 6, middle);
    pen.fillStyle = colour("grid");
    pen.fillRect(frame.left, middle - 1, frame.right - frame.left, 2);
    pen.fillStyle = colour("accent");
    for (const span of spans) {
      const some = (span.inputs[0] >> place) & 1;
      if (!some || span.second < newest - seconds) continue;
      pen.globalAlpha = (span.inputs[1] >> place) & 1 ? 1 : 0.5;
      const left = Math.max(frame.left, frame.right - (newest - span.second) * scale);
      pen.fillRect(left, middle - 5, Math.max(1, length * scale), 10);
    }
    pen.globalAlpha = 1;
  }
}

// The marks of a logarithmic axis of frequency, and where they are.
function frequencies(sheet, frame, from, to) {
  const x = (hz) => frame.left + (Math.log(hz / from) / Math.log(to / from)) * (frame.right - frame.left);
  const marks = [];
  for (let decade = -2; decade <= 4; decade += 1) for (const digit of [1, 2, 5]) marks.push(digit * 10 ** decade);
  const inside = marks.filter((hz) => hz >= from && hz <= to);
  grid(sheet, frame, inside, x, (hz) => `${hz < 0.1 ? hz.toFixed(2) : Number(hz.toPrecision(2))} Hz`, true);
  return x;
}

function line({ pen }, points) {
  pen.strokeStyle = colour("setpoint");
  pen.lineWidth = 2;
  pen.beginPath();
  points.forEach(([x, y], place) => (place ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}

// `curve` is [[hertz, per cent], ...], `modes` the frequencies that are marked.
function drawSensitivity(canvas, curve, modes) {
  const sheet = cleared(canvas);
  const { pen, width, height } = sheet;
  const frame = { left: LEFT, top: 8, right: width - RIGHT, bottom: height - 24 };
  if (!curve.length) return;
  const [from, to] = [curve[0][0], curve[curve.length - 1][0]];
  const x = frequencies(sheet, frame, from, to);
  const y = (percent) => frame.bottom - (Math.min(percent, 105) / 105) * (frame.bottom - frame.top);
  grid(sheet, frame, [0, 25, 50, 75, 100], y, (percent) => `${percent} %`, false);
  pen.strokeStyle = colour("encoder");
  pen.setLineDash([4, 4]);
  pen.beginPath();
  for (const hz of modes) {
    pen.moveTo(x(hz), frame.top);
    pen.lineTo(x(hz), frame.bottom);
  }
  pen.stroke();
  pen.setLineDash([]);
  line(sheet, curve.map(([hz, percent]) => [x(hz), y(percent)]));
}

// `curve` is [[hertz, gain, degrees], ...], of which the gain is drawn, on logarithmic axes, in the whole band
// of the sweep.
function drawResponse(canvas, curve, [from, to]) {
  const sheet = cleared(canvas);
  const frame = { left: LEFT, top: 8, right: sheet.width - RIGHT, bottom: sheet.height - 24 };
  const x = frequencies(sheet, frame, from, to);
  const decibels = curve.map(([, gain]) => 20 * Math.log10(Math.max(gain, 1e-4)));
  const low = Math.min(-20, ...decibels) - 3;
  const high = Math.max(20, ...decibels) + 3;
  const y = (level) => frame.bottom - ((level - low) / (high - low)) * (frame.bottom - frame.top);
  const levels = [];
  for (let level = Math.ceil(low / 20) * 20; level <= high; level += 20) levels.push(level);
  grid(sheet, frame, levels, y, (level) => `${level} dB`, false);
  line(sheet, curve.map(([hz], place) => [x(hz), y(decibels[place])]));
}
