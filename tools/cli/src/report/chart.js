"use strict";
// What a chart can do beyond paper: the values under the pointer, a rectangle drawn with the mouse zooms, a double
// click goes back, entries of the legend hide and show their curves. Without this script nothing is missing but that.
for (const svg of document.querySelectorAll("svg.chart")) {
  const numbers = (name) => svg.dataset[name].split(" ").map(Number);
  const [left, top, right, bottom] = numbers("frame");
  const whole = { x: numbers("x"), y: numbers("y") };
  const logarithmic = svg.dataset.log === "true";
  const plot = svg.querySelector(".plot");
  const ticks = svg.querySelector(".ticks");
  const curves = [...plot.querySelectorAll(".curve")];
  let shown = { x: whole.x, y: whole.y };

  const made = (name, attributes, parent) => {
    const element = document.createElementNS(svg.namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return parent.appendChild(element);
  };
  const clip = `clip-${Math.random().toString(36).slice(2)}`;
  const frame = { x: left, y: top, width: right - left, height: bottom - top };
  made("rect", frame, made("clipPath", { id: clip }, svg));
  plot.setAttribute("clip-path", `url(#${clip})`);
  const readout = made("g", { class: "readout", "pointer-events": "none" }, svg);

  // Pixels of the whole view to pixels of the one that is shown, and pixels to values.
  const scale = (pixel, [low, high], [from, to], [first, last]) => {
    const value = low + ((pixel - first) / (last - first)) * (high - low);
    return first + ((value - from) / (to - from)) * (last - first);
  };
  const across = (pixel) => scale(pixel, whole.x, shown.x, [left, right]);
  const up = (pixel) => scale(pixel, whole.y, shown.y, [bottom, top]);
  const valueAt = (pixel, [from, to], [first, last]) => from + ((pixel - first) / (last - first)) * (to - from);

  // Every drawn thing with the coordinates that it had at first.
  const drawn = [...plot.querySelectorAll("path, circle, line, rect, text")].map((element) => {
    const of = (name) => Number(element.getAttribute(name));
    if (element.tagName === "path") {
      const points = element.getAttribute("d").split(/[ML]/).slice(1).map((pair) => pair.split(" ").map(Number));
      const place = () => points.map(([x, y], k) => `${k ? "L" : "M"}${across(x).toFixed(1)} ${up(y).toFixed(1)}`);
      return { element, points, set: () => element.setAttribute("d", place().join("")) };
    }
    const at = { circle: [["cx"], ["cy"]], line: [["x1", "x2"], ["y1", "y2"]], text: [["x"], []], rect: [["x"], ["y"]] };
    const [xs, ys] = at[element.tagName].map((names) => names.map((name) => [name, of(name)]));
    const [width, height] = [of("width"), of("height")];
    const set = () => {
      for (const [name, x] of xs) element.setAttribute(name, across(x));
      for (const [name, y] of ys) element.setAttribute(name, up(y));
      if (element.tagName !== "rect") return;
      element.setAttribute("width", across(xs[0][1] + width) - across(xs[0][1]));
      element.setAttribute("height", up(ys[0][1] + height) - up(ys[0][1]));
    };
    const points = element.tagName === "circle" ? [[xs[0][1], ys[0][1]]] : [];
    return { element, points, set };
  });
  const points = curves.map((curve) => {
    const own = drawn.filter(({ element }) => curve.contains(element)).flatMap((thing) => thing.points);
    return own.sort((a, b) => a[0] - b[0]);
  });

  const written = (value) => {
    if (value === 0) return "0";
    const size = Math.abs(value);
    return size >= 1e5 || size < 1e-3 ? value.toExponential(2) : String(Number(value.toPrecision(4)));
  };
  // Curves are drawn to a tenth of a pixel: what is smaller was not drawn.
  const told = (value) => {
    const finest = (0.1 * (whole.y[1] - whole.y[0])) / (bottom - top);
    return Math.abs(value) < finest ? 0 : value;
  };
  const steps = ([from, to], wanted) => {
    const rough = (to - from) / wanted;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= rough);
    const first = Math.ceil(from / step);
    return Array.from({ length: Math.floor(to / step) - first + 1 }, (_, k) => Number(((first + k) * step).toPrecision(12)));
  };
  const drawTicks = () => {
    const look = ticks.querySelector("text").getAttribute("fill");
    ticks.replaceChildren();
    const label = (x, y, anchor, words) => {
      made("text", { x, y, "text-anchor": anchor, fill: look }, ticks).textContent = words;
    };
    for (const value of steps(shown.y, 6)) {
      const y = bottom - ((value - shown.y[0]) / (shown.y[1] - shown.y[0])) * (bottom - top);
      made("line", { x1: left, x2: right, y1: y, y2: y, stroke: "#e3e7eb" }, ticks);
      label(left - 7, y + 4, "end", written(logarithmic ? 10 ** value : value));
    }
    for (const value of steps(shown.x, 9)) {
      const x = left + ((value - shown.x[0]) / (shown.x[1] - shown.x[0])) * (right - left);
      made("line", { x1: x, x2: x, y1: top, y2: bottom, stroke: "#eef1f4" }, ticks);
      label(x, bottom + 17, "middle", written(value));
    }
  };
  const firstTicks = [...ticks.childNodes];
  const show = (x, y) => {
    shown = { x, y };
    for (const thing of drawn) thing.set();
    if (x === whole.x) ticks.replaceChildren(...firstTicks);
    else drawTicks();
    readout.replaceChildren();
  };

  const nearest = (own, x) => {
    let [low, high] = [0, own.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (across(own[middle][0]) < x) low = middle;
      else high = middle;
    }
    return Math.abs(across(own[low][0]) - x) <= Math.abs(across(own[high][0]) - x) ? own[low] : own[high];
  };
  const read = (x) => {
    readout.replaceChildren();
    const lines = [];
    curves.forEach((curve, index) => {
      if (curve.classList.contains("hidden") || points[index].length === 0) return;
      const [px, py] = nearest(points[index], x).map((pixel, axis) => (axis ? up(pixel) : across(pixel)));
      if (Math.abs(px - x) > 12 || py < top || py > bottom) return;
      const value = valueAt(py, shown.y, [bottom, top]);
      const look = curve.querySelector("[stroke], [fill]");
      const colour = getComputedStyle(look)[look.getAttribute("stroke") ? "stroke" : "fill"];
      made("circle", { cx: px, cy: py, r: 3, fill: colour }, readout);
      lines.push([`${curve.dataset.label} ${written(logarithmic ? 10 ** value : told(value))}`.trim(), colour]);
    });
    if (lines.length === 0) return;
    made("line", { x1: x, x2: x, y1: top, y2: bottom, stroke: "#8b949e", "stroke-width": 0.7 }, readout);
    lines.unshift([`${svg.dataset.along} ${written(valueAt(x, shown.x, [left, right]))}`, "currentColor"]);
    const width = 14 + 6.6 * Math.max(...lines.map(([words]) => words.length));
    const from = x + 10 + width > right ? x - 10 - width : x + 10;
    made("rect", { class: "box", x: from, y: top + 8, width, height: 8 + 15 * lines.length, rx: 3 }, readout);
    lines.forEach(([words, fill], row) => {
      made("text", { x: from + 7, y: top + 22 + 15 * row, fill }, readout).textContent = words;
    });
  };

  const place = (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [Math.min(Math.max(at.x, left), right), Math.min(Math.max(at.y, top), bottom)];
  };
  let began = null;
  svg.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "mouse" && event.button === 0 && !event.target.closest(".key")) began = place(event);
  });
  svg.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    if (began === null) return read(x);
    readout.replaceChildren();
    const corner = { x: Math.min(x, began[0]), y: Math.min(y, began[1]) };
    made("rect", { class: "drag", ...corner, width: Math.abs(x - began[0]), height: Math.abs(y - began[1]) }, readout);
  });
  svg.addEventListener("pointerup", (event) => {
    if (began === null) return;
    const [[x, y], [x0, y0]] = [place(event), began];
    began = null;
    readout.replaceChildren();
    const within = (a, b, range, ends) => [a, b].map((pixel) => valueAt(pixel, range, ends)).sort((p, q) => p - q);
    if (Math.abs(x - x0) < 8 || Math.abs(y - y0) < 8) return;
    show(within(x, x0, shown.x, [left, right]), within(y, y0, shown.y, [bottom, top]));
  });
  svg.addEventListener("pointerleave", () => {
    began = null;
    readout.replaceChildren();
  });
  svg.addEventListener("dblclick", () => show(whole.x, whole.y));

  for (const key of svg.querySelectorAll(".key")) {
    const curve = curves.find((one) => one.dataset.number === key.dataset.number);
    const turn = () => {
      const hidden = curve.classList.toggle("hidden");
      key.classList.toggle("off", hidden);
      key.setAttribute("aria-pressed", String(!hidden));
      readout.replaceChildren();
    };
    key.setAttribute("role", "button");
    key.setAttribute("tabindex", "0");
    key.setAttribute("aria-pressed", "true");
    key.addEventListener("click", turn);
    key.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      turn();
    });
  }
}
