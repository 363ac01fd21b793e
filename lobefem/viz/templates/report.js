"use strict";
(() => {
  const problem = document.getElementById("problem");
  function tell(text) {
    problem.textContent = "This page met an error: " + text;
    problem.hidden = false;
  }
  window.addEventListener("error", (event) => tell(event.message));
  window.addEventListener("unhandledrejection", (event) => tell(String(event.reason)));

  const data = JSON.parse(document.getElementById("data").textContent);
  const config = { responsive: true, displaylogo: false, displayModeBar: false, scrollZoom: false };
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // --- charts ------------------------------------------------------------------------------------

  function themed(layout) {
    const axis = {
      exponentformat: "power", gridcolor: colour("--grid"), linecolor: colour("--line"), zerolinecolor: colour("--quiet"), automargin: true,
    };
    return {
      ...layout,
      xaxis: { ...axis, ...layout.xaxis },
      yaxis: { ...axis, ...layout.yaxis },
      font: { color: colour("--ink"), family: "system-ui, DejaVu Sans, sans-serif", size: 13 },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      margin: { l: 70, r: 15, t: 15, b: 50 }, hovermode: "closest",
      legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 },
    };
  }
  // black curves are for paper
  function traced(trace) {
    const line = trace.line && trace.line.color === "black" ? { ...trace.line, color: colour("--ink") } : trace.line;
    return line ? { ...trace, line } : trace;
  }
  // five megabytes of script that only plots need: the page can be read before they run
  function needPlotly() {
    if (window.Plotly) return;
    const script = document.createElement("script");
    script.textContent = document.getElementById("plotly").textContent;
    document.head.append(script);
  }
  function drawChart([id, chart]) {
    needPlotly();
    Plotly.react(id, chart.data.map(traced), themed(chart.layout), config);
  }

  // --- the 3D view -------------------------------------------------------------------------------

  function unpack(text, Kind) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Kind(bytes.buffer);
  }
  const HOME = { up: { x: 0, y: 0, z: 1 }, center: { x: 0, y: 0, z: 0 }, eye: { x: 0.5, y: -1.35, z: 0.5 } };
  const view = document.getElementById("view");
  const choice = document.getElementById("view-choice");
  const slider = document.getElementById("view-scale");
  const said = document.getElementById("view-scale-said");
  const shown = []; // [scene, view] of each option
  let camera = structuredClone(HOME);

  function fill() {
    for (const scene of data.scenes) {
      scene.nodes = unpack(scene.x, Float32Array);
      scene.cells = unpack(scene.triangles, Uint32Array);
      scene.loops = scene.plates.map((loop) => unpack(loop, Uint32Array));
      scene.drawn = scene.lines.map((line) => unpack(line, Uint32Array));
      let group = null;
      for (const one of scene.views) {
        const label = data.scenes.length > 1 ? scene.name + ", " + one.group
          : one.group[0].toUpperCase() + one.group.slice(1);
        if (group === null || group.label !== label) {
          group = document.createElement("optgroup");
          group.label = label;
          choice.append(group);
        }
        const option = document.createElement("option");
        option.value = String(shown.length);
        option.textContent = one.name;
        group.append(option);
        shown.push([scene, one]);
      }
    }
  }
  // a mode is turned over and doubled by its slider, a state's displacement shown up to 10 000 times
  function setSlider(one) {
    const mode = one.kind === "mode";
    Object.assign(slider, mode ? { min: -2, max: 2, step: 0.1 } : { min: 0, max: 5, step: 1 });
    slider.value = "1";
  }
  function factor(one) {
    const value = Number(slider.value);
    return one.kind === "mode" ? value : value === 0 ? 0 : 10 ** (value - 1);
  }
  const columns = (nodes) => {
    const count = nodes.length / 3, xyz = [0, 1, 2].map(() => new Float32Array(count));
    for (let n = 0; n < count; n++) for (let k = 0; k < 3; k++) xyz[k][n] = nodes[3 * n + k];
    return xyz;
  };
  function colours(one) {
    if (one.kind === "regions") {
      const steps = data.regions.flatMap(([, fill], k) => [[k / 3, fill], [(k + 1) / 3, fill]]);
      return { colorscale: steps, ticks: { tickvals: [0, 1, 2], ticktext: data.regions.map(([name]) => name) } };
    }
    const both = one.kind === "stress" && one.range[0] === -one.range[1];
    // Brown to purple where there are both signs; both scales are safe for colour-blind readers.
    const diverging = [[0, "#7f3b08"], [0.25, "#e08214"], [0.5, "#f7f7f7"], [0.75, "#8073ac"], [1, "#2d004b"]];
    return { colorscale: both ? diverging : one.kind === "stress" ? "Cividis" : "Viridis", ticks: {} };
  }
  // ranges of the axes of a cube around a shape as designed, and as drawn
  function cube(designed, placed) {
    const ends = (nodes) => [0, 1, 2].map((k) => {
      let low = Infinity, high = -Infinity;
      for (let n = k; n < nodes.length; n += 3) {
        low = Math.min(low, nodes[n]);
        high = Math.max(high, nodes[n]);
      }
      return [low, high];
    });
    const first = ends(designed), middle = first.map(([low, high]) => (low + high) / 2);
    let half = 0.6 * Math.max(...first.map(([low, high]) => high - low));
    ends(placed).forEach((one, k) => { half = Math.max(half, ...one.map((end) => Math.abs(end - middle[k]))); });
    return middle.map((m) => [m - half, m + half]);
  }
  function drawView() {
    const [scene, one] = shown[Number(choice.value)];
    const moved = unpack(one.moved, Int16Array), scale = factor(one) * one.scale;
    const placed = scene.nodes.map((x, k) => x + scale * moved[k]);
    const [x, y, z] = columns(placed), cells = scene.cells, count = cells.length / 3;
    const [i, j, k] = [0, 1, 2].map((c) => Uint32Array.from({ length: count }, (_, n) => cells[3 * n + c]));
    const { colorscale, ticks } = colours(one);
    const light = { ambient: 0.65, diffuse: 0.6, specular: 0.08, roughness: 0.9, fresnel: 0.05, facenormalsepsilon: 0, vertexnormalsepsilon: 0 };
    const film = {
      type: "mesh3d", x, y, z, i, j, k, intensity: unpack(one.values, Float32Array),
      intensitymode: one.cells ? "cell" : "vertex", cmin: one.range[0], cmax: one.range[1], colorscale,
      lighting: light, lightposition: { x: 2000, y: -6000, z: 4000 }, flatshading: true, hoverinfo: "none",
      colorbar: { title: { text: one.bar, side: "right" }, thickness: 14, len: 0.75, outlinewidth: 0, exponentformat: "power", ...ticks },
    };
    const plates = scene.loops.map((loop) => {
      const rim = [x, y, z].map((c) => Array.from(loop, (n) => c[n])), size = loop.length;
      const [px, py, pz] = rim.map((c) => [...c, c.reduce((a, b) => a + b, 0) / size]);
      const around = Array.from(loop, (_, n) => n);
      return {
        type: "mesh3d", x: px, y: py, z: pz, i: around, j: around.map((n) => (n + 1) % size),
        k: around.map(() => size), color: "#b4b4b4", lighting: light, hoverinfo: "none", flatshading: true,
      };
    });
    const designed = { x: [], y: [], z: [] };
    for (const line of scene.drawn) {
      for (const n of line) ["x", "y", "z"].forEach((axis, c) => designed[axis].push(scene.nodes[3 * n + c]));
      for (const axis of ["x", "y", "z"]) designed[axis].push(null);
    }
    const dotted = {
      type: "scatter3d", mode: "lines", ...designed, hoverinfo: "none", showlegend: false,
      line: { color: colour("--quiet"), width: 1.5, dash: "dot" },
    };
    const [xaxis, yaxis, zaxis] = cube(scene.nodes, placed).map((range) => ({ visible: false, range }));
    const layout = {
      scene: { xaxis, yaxis, zaxis, aspectmode: "cube", camera, dragmode: "turntable" },
      font: { color: colour("--ink"), family: "system-ui, DejaVu Sans, sans-serif", size: 13 },
      paper_bgcolor: "rgba(0,0,0,0)", margin: { l: 0, r: 0, t: 0, b: 0 },
    };
    const times = "× " + factor(one).toPrecision(one.kind === "mode" ? 2 : 1).replace("-", "\u2212");
    said.textContent = one.kind === "mode" ? times + " as drawn" : times;
    slider.setAttribute("aria-valuetext", said.textContent);
    const label = choice.selectedOptions[0].parentElement.label;
    document.getElementById("view-said").textContent = label + ": " + one.name + ".";
    return Plotly.react(view, [film, ...plates, dotted], layout, { ...config, scrollZoom: true });
  }
  function turn(how) {
    const { x, y, z } = camera.eye, far = Math.hypot(x, y, z);
    let around = Math.atan2(y, x), up = Math.asin(z / far), size = far;
    const step = Math.PI / 12;
    if (how === "reset") {
      camera = structuredClone(HOME);
    } else {
      around += { left: -step, right: step }[how] || 0;
      up = Math.max(-1.5, Math.min(1.5, up + ({ up: step, down: -step }[how] || 0)));
      size *= { nearer: 0.85, farther: 1 / 0.85 }[how] || 1;
      const flat = size * Math.cos(up);
      camera = { ...camera, eye: { x: flat * Math.cos(around), y: flat * Math.sin(around), z: size * Math.sin(up) } };
    }
    Plotly.relayout(view, { "scene.camera": camera });
  }
  const KEYS = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down", "+": "nearer", "=": "nearer",
    "-": "farther", Home: "reset" };

  function startView() {
    needPlotly();
    fill();
    setSlider(shown[0][1]);
    drawView();
    view.on("plotly_relayout", (change) => {
      if (change["scene.camera"]) camera = change["scene.camera"];
    });
    choice.addEventListener("change", () => {
      setSlider(shown[Number(choice.value)][1]);
      drawView();
    });
    slider.addEventListener("input", drawView);
    for (const button of document.querySelectorAll("[data-turn]")) {
      button.addEventListener("click", () => turn(button.dataset.turn));
    }
    view.addEventListener("keydown", (event) => {
      if (event.altKey || event.ctrlKey || event.metaKey || !(event.key in KEYS)) return;
      event.preventDefault();
      turn(KEYS[event.key]);
    });
  }

  // --- tables -------------------------------------------------------------------------------------

  // the tab key stops at a table to scroll it, so not at one that fits
  const stops = () => document.querySelectorAll(".scroll").forEach((one) => {
    one.tabIndex = one.scrollWidth > one.clientWidth ? 0 : -1;
  });
  stops();
  window.addEventListener("resize", stops);
  document.addEventListener("toggle", stops, true);

  // --- when what is drawn -------------------------------------------------------------------------

  // What comes into sight is drawn at once; the rest one after the other, so that the page
  // can be read and scrolled meanwhile; on paper all of it.
  const waiting = new Map(view ? [[view, startView]] : []);
  for (const chart of Object.entries(data.charts)) waiting.set(document.getElementById(chart[0]), () => drawChart(chart));
  const drawn = [];
  function draw(element) {
    const make = waiting.get(element);
    if (!make) return;
    waiting.delete(element);
    make();
    drawn.push(element);
    element.dataset.drawn = Math.round(performance.now()) + " ms";
    if (!waiting.size) document.documentElement.dataset.drawn = element.dataset.drawn;
  }
  const redrawCharts = () => drawn.filter((one) => one !== view).forEach((one) => drawChart([one.id, data.charts[one.id]]));
  const redraw = () => { redrawCharts(); if (drawn.includes(view)) drawView(); };
  const watch = new IntersectionObserver((seen) => seen.filter((one) => one.isIntersecting).forEach(({ target }) => {
    watch.unobserve(target);
    setTimeout(() => draw(target));
  }), { rootMargin: "200px" });
  [...waiting.keys()].forEach((one) => watch.observe(one));
  const next = () => {
    const [first] = waiting.keys();
    if (!first) return;
    draw(first);
    setTimeout(next, 20);
  };
  window.addEventListener("load", () => setTimeout(next, 20));
  window.addEventListener("beforeprint", () => [...waiting.keys()].filter((one) => one !== view).forEach(draw));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  matchMedia("print").addEventListener("change", redrawCharts); // in the colours of paper
})();
