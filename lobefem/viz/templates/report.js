// The page: which run, state and mode the view shows, what is drawn when, which section is in sight.

const problem = document.getElementById("problem");
function tell(text) {
  problem.textContent = "This page met an error: " + text;
  problem.hidden = false;
}
window.addEventListener("error", (event) => tell(event.message));
window.addEventListener("unhandledrejection", (event) => tell(String(event.reason)));

const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
setTables();

// --- charts: drawn when they come into sight, and before printing --------------------------------

const charts = new Map();
function redraw(element) {
  const { id, show } = charts.get(element);
  if (!element.clientWidth) return;
  element.dataset.label = element.dataset.label || "";
  drawChart(element, data.charts[id], show);
  element.dataset.drawn = Math.round(performance.now()) + " ms";
}
const watch = new IntersectionObserver((seen) => seen.forEach((one) => {
  if (one.isIntersecting && charts.has(one.target) && !one.target.dataset.drawn) redraw(one.target);
}), { rootMargin: "300px" });
const sizes = new ResizeObserver((seen) => seen.forEach((one) => {
  if (one.target.dataset.drawn && one.target.clientWidth !== Number(one.target.dataset.width)) {
    one.target.dataset.width = one.target.clientWidth;
    redraw(one.target);
  }
}));
for (const element of document.querySelectorAll("[data-chart]")) {
  charts.set(element, { id: element.dataset.chart, show: null });
  watch.observe(element);
  sizes.observe(element);
}
// on paper nothing can be clicked: what is to be checked is told
window.addEventListener("beforeprint", () => document.querySelectorAll("details.why").forEach((one) => { one.open = true; }));
window.addEventListener("beforeprint", () => charts.forEach((_, element) => { if (!element.dataset.drawn) redraw(element); }));

// --- the view -------------------------------------------------------------------------------------

const canvas = byId("view"), main = byId("main-chart");
const runs = data.runs; // each a name, a scene or null, and the id of its chart or null
let run = 0, view = null, chosen = { state: 0, option: 0 };
const control = { run: byId("run-choice"), state: byId("state"), said: byId("state-said"), option: byId("option"), scale: byId("scale"), scaleSaid: byId("scale-said"), play: byId("play") };
const options = (state) => [
  ...state.modes.map((mode) => ({ name: mode.name, mode })),
  ...state.fields.map((field) => ({ name: field.name, field })),
  { name: "Shape alone" },
];
// a mode is turned over and doubled by its slider, a state's displacement shown up to 10 000 times
function factor() {
  const value = Number(control.scale.value), mode = current().mode;
  return mode ? value : value === 0 ? 0 : 10 ** (value - 1);
}
const current = () => options(runs[run].scene.states[chosen.state])[chosen.option];

function setScale(mode) {
  Object.assign(control.scale, mode ? { min: -2, max: 2, step: 0.1 } : { min: 0, max: 4, step: 0.5 });
  control.scale.value = "1";
}
function fillOptions() {
  const state = runs[run].scene.states[chosen.state];
  control.option.replaceChildren(...options(state).map((one, k) => {
    const option = document.createElement("option");
    option.value = String(k);
    option.textContent = one.name;
    return option;
  }));
}
function bar(one) {
  const box = byId("bar"), field = one.field;
  box.hidden = !field && !one.mode;
  if (box.hidden) return;
  const kind = one.mode ? (view.sideways ? "size" : "motion") : field.kind;
  box.dataset.kind = kind;
  const ends = one.mode ? (view.sideways ? ["none", "largest"] : ["inwards", "outwards"]) : kind === "regions" ? null : field.range.map(shown);
  byId("bar-low").textContent = ends ? ends[0] : "";
  byId("bar-high").textContent = ends ? ends[1] : "";
  byId("bar-name").textContent = one.mode ? "motion of the film" : field.bar;
  byId("bar-regions").hidden = kind !== "regions";
  byId("bar-colours").hidden = kind === "regions";
}
function showState(keep) {
  const scene = runs[run].scene, state = scene.states[chosen.state], one = current();
  if (!keep) setScale(Boolean(one.mode));
  const { mode, field } = one, by = factor();
  view.amplitude = mode ? by : 0;
  view.phase = 0;
  view.set(scene, state, mode, field, mode ? 1 : by);
  control.option.value = String(chosen.option);
  control.state.value = String(chosen.state);
  control.state.setAttribute("aria-valuetext", state.name);
  control.said.textContent = state.name;
  const times = "\u00d7 " + shown(Number(by.toPrecision(2)));
  control.scaleSaid.textContent = mode ? times + " as drawn" : times;
  control.scale.setAttribute("aria-valuetext", control.scaleSaid.textContent);
  byId("view-said").textContent = `${runs.length > 1 ? runs[run].name + ", " : ""}${state.name}: ${one.name}.`;
  canvas.setAttribute("aria-label", "3D view. " + byId("view-said").textContent + " Arrow keys turn it, plus and minus zoom, space swings a mode.");
  canvas.dataset.shown = byId("view-said").textContent;
  control.play.disabled = !mode && scene.states.length < 3;
  bar(one);
  const shownNow = mode ? `${run}:${chosen.state}:${state.modes.indexOf(mode)}` : "";
  const thumbs = [...document.querySelectorAll(".thumb")], prefix = `${run}:${chosen.state}:`;
  const own = thumbs.filter((thumb) => thumb.dataset.view.startsWith(prefix));
  thumbs.forEach((thumb) => {
    thumb.setAttribute("aria-pressed", String(thumb.dataset.view === shownNow));
    thumb.hidden = own.length < 2 || !own.includes(thumb);
  });
}
function go(state, option) {
  const scene = runs[run].scene, before = chosen.option < options(scene.states[chosen.state]).length ? current().name.split(",")[0] : "";
  chosen.state = state;
  const list = options(scene.states[state]);
  const same = list.findIndex((one) => one.name.split(",")[0] === before);
  chosen.option = option !== undefined ? option : Math.max(same, 0);
  fillOptions();
  showState(false);
}
function show(text) { // "state:mode" or "state:"
  const [state, mode] = text.split(":");
  stop();
  const list = options(runs[run].scene.states[Number(state)]);
  const plain = Math.max(list.findIndex((one) => !one.mode), 0);
  go(Number(state), mode === "" ? plain : Number(mode));
}
function setRun(k, state, option) {
  stop();
  run = k;
  const { scene, chart, title, label } = runs[run];
  byId("view-figure").hidden = !scene;
  byId("chart-figure").hidden = chart === null;
  document.querySelector(".pair").classList.toggle("single", !scene || chart === null);
  if (chart !== null) {
    byId("main-title").textContent = title;
    byId("main-said").textContent = label;
    main.dataset.label = title + ". " + label;
    charts.set(main, { id: chart, show: scene ? show : null });
    redraw(main);
  }
  if (scene && view) {
    control.state.max = String(scene.states.length - 1);
    byId("state-control").hidden = scene.states.length < 2;
    chosen = { state: 0, option: 0 };
    go(state === undefined ? scene.first : state, option === undefined ? 0 : option);
  }
  if (control.run) control.run.value = String(run);
}
let playing = null;
function stop() {
  if (playing === null) return;
  cancelAnimationFrame(playing);
  playing = null;
  control.play.setAttribute("aria-pressed", "false");
  byId("play-word").textContent = "Play";
  if (view && view.scene && current().mode) {
    view.phase = 0;
    view.draw();
  }
}
function play() {
  if (playing !== null) {
    stop();
    return;
  }
  control.play.setAttribute("aria-pressed", "true");
  byId("play-word").textContent = "Stop";
  const begun = performance.now(), from = chosen.state;
  let last = -1;
  const frame = (now) => {
    const seconds = (now - begun) / 1000;
    if (current().mode) {
      view.phase = 2 * Math.PI * 0.6 * seconds;
      view.draw();
    } else { // a motion: state after state
      const count = runs[run].scene.states.length, at = (from + Math.floor(seconds * 12)) % count;
      if (at !== last) {
        last = at;
        chosen.state = at;
        fillOptions();
        chosen.option = Math.max(options(runs[run].scene.states[at]).findIndex((one) => !one.mode), 0);
        showState(true);
      }
    }
    playing = requestAnimationFrame(frame);
  };
  playing = requestAnimationFrame(frame);
}
function startView() {
  const first = runs.findIndex((one) => one.scene);
  if (first >= 0) {
    try {
      view = new View(canvas, data.palettes);
    } catch (error) {
      byId("view-said").textContent = `No 3D view: ${error.message}. The pictures and tables hold the same shapes.`;
      document.querySelectorAll("#view-figure .controls, #view-figure .turns").forEach((one) => { one.hidden = true; });
    }
  }
  if (view) {
    const KEYS = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down", "+": "nearer", "=": "nearer", "-": "farther", Home: "reset" };
    canvas.addEventListener("keydown", (event) => {
      if (event.altKey || event.ctrlKey || event.metaKey) return;
      if (event.key === " " && !control.play.disabled) play();
      else if (event.key in KEYS) view.turn(KEYS[event.key]);
      else return;
      event.preventDefault();
    });
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      held = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      view.around -= (event.clientX - held[0]) * 0.008;
      view.above = Math.max(-1.5, Math.min(1.5, view.above + (event.clientY - held[1]) * 0.008));
      held = [event.clientX, event.clientY];
      view.draw();
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas && !event.ctrlKey) return; // else the page would not scroll past it
      event.preventDefault();
      view.zoom = Math.max(0.3, Math.min(12, view.zoom * Math.exp(-event.deltaY * 0.0015)));
      view.draw();
    }, { passive: false });
    for (const button of document.querySelectorAll("[data-turn]")) button.addEventListener("click", () => view.turn(button.dataset.turn));
    control.state.addEventListener("input", () => {
      stop();
      go(Number(control.state.value));
    });
    control.option.addEventListener("change", () => {
      stop();
      chosen.option = Number(control.option.value);
      showState(false);
    });
    control.scale.addEventListener("input", () => showState(true));
    control.play.addEventListener("click", play);
    byId("save").addEventListener("click", () => canvas.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = (runs[run].name + " " + current().name).replace(/[^\w.-]+/g, "-") + ".png";
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    }));
    new ResizeObserver(() => view.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => view.draw());
    window.addEventListener("beforeprint", () => view.draw());
  }
  setRun(Math.max(first, 0));
}
for (const thumb of document.querySelectorAll(".thumb, .card-picture button")) {
  thumb.addEventListener("click", () => {
    const [which, state, mode] = thumb.dataset.view.split(":").map(Number);
    if (!view) return;
    setRun(which, state, mode);
    byId("shapes").scrollIntoView({ block: "start" });
  });
}
if (control.run) control.run.addEventListener("change", () => setRun(Number(control.run.value)));
if (byId("shapes")) {
  sizes.observe(main);
  // after the first screen is there
  window.addEventListener("load", () => setTimeout(() => {
    startView();
    document.documentElement.dataset.drawn = Math.round(performance.now()) + " ms";
  }, 20));
} else document.documentElement.dataset.drawn = Math.round(performance.now()) + " ms";

// --- where the reader is --------------------------------------------------------------------------

const links = new Map([...document.querySelectorAll("nav a")].map((link) => [link.hash.slice(1), link]));
const marks = [...links.keys()].map(byId).filter(Boolean);
const here = () => {
  const at = marks.filter((mark) => mark.getBoundingClientRect().top < 0.35 * innerHeight).pop() || marks[0];
  links.forEach((link, id) => (at && id === at.id ? link.setAttribute("aria-current", "true") : link.removeAttribute("aria-current")));
};
window.addEventListener("scroll", here, { passive: true });
here();
// a link into something folded opens it
window.addEventListener("hashchange", () => {
  const target = byId(location.hash.slice(1));
  for (let one = target; one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
});
