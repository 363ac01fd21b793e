// Charts: SVG drawn from plain data. Colours are classes, so that light, dark and paper need no redrawing.

const SVG = "http://www.w3.org/2000/svg";
function node(name, attributes, parent, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}
function shown(value) {
  if (value === 0) return "0";
  const size = Math.abs(value), far = size >= 1e6 || size < 1e-3;
  const text = far ? value.toExponential(2).replace(/\.?0+e/, "e").replace("e+", "e") : String(Number(value.toPrecision(4)));
  return text.replace(/-/g, "\u2212");
}

function roundTicks(low, high, count) {
  const raw = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((k) => k * power).find((k) => k >= raw) || 10 * power;
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(k * step);
  return ticks;
}
// value -> share of the axis, and the values that are named on it
function scaleOf(axis, values, count) {
  const found = values.filter((v) => Number.isFinite(v) && (axis.scale !== "log" || v > 0));
  let [low, high] = axis.range || [Math.min(...found), Math.max(...found)];
  if (!Number.isFinite(low) || !Number.isFinite(high)) [low, high] = [0.1, 1];
  if (low === high) {
    const more = Math.abs(low) * 0.1 || 1;
    [low, high] = [low - more, high + more];
  }
  if (axis.scale === "log") {
    if (!axis.range) {
      const more = (high / low) ** 0.06;
      [low, high] = [low / more, high * more];
    }
    const a = Math.log(low), b = Math.log(high);
    let ticks = axis.ticks;
    if (!ticks) {
      ticks = [];
      const decades = (b - a) / Math.LN10, parts = decades > 5 ? [1] : decades > 1.6 ? [1, 3] : [1, 1.5, 2, 3, 4, 5, 7];
      for (let k = Math.floor(a / Math.LN10); k <= Math.ceil(b / Math.LN10); k++) {
        for (const part of parts) ticks.push(part * 10 ** k);
      }
      ticks = ticks.filter((v) => v >= low && v <= high);
      if (ticks.length < 2) ticks = roundTicks(low, high, count); // less than a decade
    }
    return { at: (v) => (v > 0 ? (Math.log(v) - a) / (b - a) : NaN), ticks };
  }
  if (axis.scale === "symlog") {
    const c = axis.linear, f = (v) => Math.sign(v) * Math.log1p(Math.abs(v) / c), a = f(low), b = f(high);
    const sizes = [0];
    for (let k = Math.floor(Math.log10(c)); 10 ** k <= Math.max(high, -low); k++) sizes.push(10 ** k, -(10 ** k));
    let ticks = sizes.filter((v) => v >= low && v <= high).sort((x, y) => x - y);
    const apart = (list) => list.filter((v, k) => k === 0 || f(v) - f(list[k - 1]) > 0.04 * (b - a) || v === 0);
    ticks = apart(ticks).filter((v) => v === 0 || Math.abs(f(v)) > 0.06 * (b - a));
    return { at: (v) => (f(v) - a) / (b - a), ticks };
  }
  if (!axis.range) {
    const more = 0.05 * (high - low);
    [low, high] = [!axis.ticks && low > 0 && low < 0.4 * high ? 0 : low - more, high + more];
  }
  return { at: (v) => (v - low) / (high - low), ticks: axis.ticks || roundTicks(low, high, count) };
}

const MARKERS = {
  twist: (r) => `M${-r},${-r}h${2 * r}v${2 * r}h${-2 * r}z`,
  global: (r) => `M0,${-1.3 * r}l${1.2 * r},${2.3 * r}h${-2.4 * r}z`,
  local: (r) => `M0,${-1.4 * r}l${1.4 * r},${1.4 * r}l${-1.4 * r},${1.4 * r}l${-1.4 * r},${-1.4 * r}z`,
};
const circle = (r) => `M${-r},0a${r},${r} 0 1,0 ${2 * r},0a${r},${r} 0 1,0 ${-2 * r},0z`;

let clips = 0;
// Draws a chart into an element; `show(view)` is called for the point that a reader chooses.
function drawChart(element, spec, show) {
  const width = Math.max(element.clientWidth, 240), height = Math.max(element.clientHeight, 180);
  element.querySelectorAll("svg, .tip").forEach((one) => one.remove());
  const strong = spec.series.filter((s) => s.colour !== "quiet");
  const xs = spec.series.flatMap((s) => s.x), ys = spec.series.flatMap((s) => s.y);
  if (spec.mark) {
    xs.push(spec.mark[0]);
    ys.push(spec.mark[1]);
  }
  if (spec.y.scale === "symlog") {
    const sizes = (strong.length ? strong : spec.series).map((s) => Math.max(...s.y.map((v) => Math.abs(v || 0))));
    spec.y.linear = Math.max(Math.min(...sizes.filter((v) => v > 0)), 1e-4 * spec.y.range[1]);
  }
  const left = 64, right = 16, bottom = 46, top = 30, wide = width - left - right, tall = height - top - bottom;
  const X = scaleOf(spec.x, xs, wide / 90), Y = scaleOf(spec.y, ys, tall / 45);
  const px = (v) => left + X.at(v) * wide, py = (v) => top + (1 - Y.at(v)) * tall;
  const svg = node("svg", {
    viewBox: `0 0 ${width} ${height}`, width, height, role: "img", tabindex: "0", class: "drawing",
    "aria-label": element.dataset.label + " Arrow keys go from point to point, Enter shows the shape.",
  }, element);
  const clip = `clip-${clips++}`;
  node("rect", { x: left, y: top - 6, width: wide + 6, height: tall + 12 }, node("clipPath", { id: clip }, node("defs", {}, svg)));
  const inside = (y) => Math.min(Math.max(y, top), top + tall);
  if (spec.unstable && Y.at(0) > 0) {
    const zero = inside(py(0));
    node("rect", { x: left, y: zero, width: wide, height: top + tall - zero, class: "unstable" }, svg);
    if (top + tall - zero > 14) node("text", { x: left + 6, y: top + tall - 6, class: "note" }, svg, "unstable");
  }
  if (spec.band) {
    const a = px(spec.band[0]), b = px(spec.band[1]);
    node("rect", { x: a, y: top, width: Math.max(b - a, 2), height: tall, class: "band" }, svg);
  }
  for (const v of X.ticks) {
    const x = px(v);
    node("line", { x1: x, x2: x, y1: top, y2: top + tall, class: "grid" }, svg);
    const name = spec.x.names ? spec.x.names[X.ticks.indexOf(v)] : shown(v);
    node("text", { x, y: top + tall + 17, "text-anchor": "middle", class: "tick" }, svg, name);
  }
  for (const v of Y.ticks) {
    const y = py(v);
    node("line", { x1: left, x2: left + wide, y1: y, y2: y, class: v === 0 ? "zero" : "grid" }, svg);
    node("text", { x: left - 7, y: y + 4, "text-anchor": "end", class: "tick" }, svg, shown(v));
  }
  node("line", { x1: left, x2: left + wide, y1: top + tall, y2: top + tall, class: "axis" }, svg);
  node("line", { x1: left, x2: left, y1: top, y2: top + tall, class: "axis" }, svg);
  node("text", { x: left + wide / 2, y: height - 8, "text-anchor": "middle", class: "label" }, svg, spec.x.label);
  node("text", { transform: `translate(14 ${top + tall / 2}) rotate(-90)`, "text-anchor": "middle", class: "label" }, svg, spec.y.label);

  const plot = node("g", { "clip-path": `url(#${clip})` }, svg), points = [];
  const ordered = [...spec.series.filter((s) => s.colour === "quiet"), ...strong];
  for (const s of ordered) {
    if (s.width > 0) {
      let path = "", pen = "M";
      s.x.forEach((x, k) => {
        const y = s.y[k];
        const there = x !== null && y !== null && Number.isFinite(px(x)) && Number.isFinite(py(y));
        if (there) path += `${pen}${px(x).toFixed(1)},${py(y).toFixed(1)}`;
        pen = there ? "L" : "M";
      });
      node("path", { d: path, class: `curve k-${s.colour}`, "stroke-width": s.width, ...(s.dash ? { "stroke-dasharray": "6 4" } : {}) }, plot);
    }
    const marker = MARKERS[s.colour] || circle;
    let markers = "";
    s.x.forEach((x, k) => {
      const y = s.y[k];
      if (x === null || y === null) return;
      const at = { x: px(x), y: py(y), hint: s.hints[k] || s.name, view: s.views[k] || "" };
      if (!Number.isFinite(at.x) || !Number.isFinite(at.y) || at.y < top - 6 || at.y > top + tall + 6) return;
      if (s.size > 0) markers += marker(s.size).replace("M", `M${at.x.toFixed(1)},${at.y.toFixed(1)}m`);
      if (s.hints.length) points.push(at);
    });
    // a path a series: a thousand elements would be slow
    if (markers) node("path", { d: markers, class: `points k-${s.colour}` }, plot);
  }
  if (spec.mark) {
    const x = px(spec.mark[0]), y = py(spec.mark[1]), end = x > left + 0.55 * wide;
    node("circle", { cx: x, cy: y, r: 9, class: "mark" }, svg);
    node("text", { x: x + (end ? -14 : 14), y: y - 9, "text-anchor": end ? "end" : "start", class: "answer" }, svg, spec.mark[2]);
  } else if (spec.band) {
    const text = node("text", { x: 0, y: top + tall - 22, "text-anchor": "middle", class: "answer" }, svg, spec.band[2]);
    const half = text.getComputedTextLength() / 2 + 6, middle = (px(spec.band[0]) + px(spec.band[1])) / 2;
    if (2 * half > wide) text.remove(); // the words below the chart say it
    text.setAttribute("x", Math.min(Math.max(middle, left + half), left + wide - half));
  }
  const names = new Map(strong.filter((s) => s.name).map((s) => [s.name, s]));
  let x = left;
  if (names.size > 1 || (names.size && spec.series.length > 1)) for (const [name, s] of names) {
    const g = node("g", { transform: `translate(${x + 6} 12)` }, svg);
    if (s.width > 0) node("path", { d: "M-6,0H14", class: `curve k-${s.colour}`, "stroke-width": s.width, ...(s.dash ? { "stroke-dasharray": "6 4" } : {}) }, g);
    if (s.size > 0) node("path", { d: (MARKERS[s.colour] || circle)(4).replace("M", "M4,0m"), class: `points k-${s.colour}` }, g);
    const text = node("text", { x: 20, y: 4, class: "tick" }, g, name);
    x += 38 + text.getComputedTextLength();
  }

  const ring = node("circle", { r: 8, class: "ring", visibility: "hidden" }, svg);
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  element.append(tip);
  let at = -1;
  const point = (k, said) => {
    at = k;
    ring.setAttribute("visibility", k < 0 ? "hidden" : "visible");
    tip.hidden = k < 0;
    if (k < 0) return;
    const one = points[k];
    ring.setAttribute("cx", one.x);
    ring.setAttribute("cy", one.y);
    tip.textContent = one.hint + (one.view && show ? " \u2013 click to see it" : "");
    tip.style.left = Math.min(Math.max(one.x, 90), width - 90) + "px";
    tip.style.top = one.y + "px";
    tip.classList.toggle("below", one.y < 70);
    if (said) tip.setAttribute("role", "status");
  };
  const nearest = (event) => {
    const box = svg.getBoundingClientRect(), mx = ((event.clientX - box.left) * width) / box.width, my = ((event.clientY - box.top) * height) / box.height;
    let best = -1, least = 900;
    points.forEach((one, k) => {
      const far = (one.x - mx) ** 2 + (one.y - my) ** 2 - (one.view ? 60 : 0);
      if (far < least) [best, least] = [k, far];
    });
    return best;
  };
  const choose = () => {
    if (at >= 0 && points[at].view && show) show(points[at].view);
  };
  svg.addEventListener("pointermove", (event) => {
    const k = nearest(event);
    svg.classList.toggle("hot", k >= 0 && Boolean(points[k].view) && Boolean(show));
    point(k);
  });
  svg.addEventListener("pointerleave", () => point(-1));
  svg.addEventListener("blur", () => point(-1));
  svg.addEventListener("click", (event) => {
    point(nearest(event));
    choose();
  });
  svg.addEventListener("keydown", (event) => {
    const moves = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 };
    if (event.key in moves && points.length) {
      event.preventDefault();
      point((at + moves[event.key] + points.length) % points.length, true);
    } else if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      choose();
    }
  });
  element.dataset.points = points.length;
}
