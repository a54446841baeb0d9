"use strict";
// The page of `stillbeam live`. Addresses are relative: the token is in the path of this page and nowhere else.

const by = (id) => document.getElementById(id);
const KINDS = ["zv", "zvd", "zvdd", "zvddd", "ei", "ei2", "ei3", "mzv"];
const AT_REST = ["rest"];
const LONGEST_S = 30;

let facts = null; // the board: name, ticks per second, settings
let page = ""; // the name of this page, from the socket
let socket = null;
let frame = null; // the newest one
let spans = [];
let controls = false;
let newestSecond = 0;
let firstTick = null;

// ---- asking ----

async function ask(path, body) {
  try {
    const headers = { "x-stillbeam-page": page, "content-type": "application/json" };
    const response = await fetch(path, { method: "POST", headers, body: JSON.stringify(body ?? {}) });
    const text = await response.text();
    let answer;
    try {
      answer = JSON.parse(text);
    } catch {
      answer = { refused: text.trim() };
    }
    return response.ok ? { ok: true, answer } : { ok: false, refused: answer.refused ?? text.trim() };
  } catch {
    return { ok: false, refused: "stillbeam live does not answer; look at its terminal" };
  }
}

function tell(words, kind) {
  by("told").textContent = words;
  by("told").dataset.kind = kind;
}

// Asks, and says what came of it.
async function order(path, body, done) {
  const result = await ask(path, body);
  if (result.ok) tell(done ?? "", "done");
  else tell(result.refused, "refused");
  return result;
}

// By both ways: the socket is open already, and the request works where the socket does not.
function stop() {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send("stop");
  ask("stop").then((result) => {
    if (result.ok) tell("Stop: the axis brakes and the drive is switched off. Enable it to go on.", "done");
    else tell(`Stop was not taken: ${result.refused}. Use the emergency stop of the machine.`, "refused");
  });
}

// ---- the stream ----

function connect() {
  const address = new URL("socket", location.href);
  address.protocol = "ws:";
  socket = new WebSocket(address);
  socket.onmessage = (message) => take(JSON.parse(message.data));
  socket.onclose = () => {
    setControl(false);
    page = "";
    badge("not connected", "alarm");
    setTimeout(connect, 1000);
  };
}

function here() {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send("here");
}

function take(news) {
  if (news.page) {
    page = news.page;
    readBoard();
  } else if (news.refused) {
    tell(news.refused, "refused");
  } else {
    frame = news;
    if (facts) addSpans(news.spans);
    here();
    if (facts && news.settings !== facts.settings.version) readBoard();
    requestAnimationFrame(draw);
  }
}

async function readBoard() {
  const response = await fetch("board");
  if (!response.ok) return;
  const before = facts;
  facts = await response.json();
  by("board").textContent = facts.board;
  if (!before || before.settings.version !== facts.settings.version) fill(facts.settings);
}

// Ticks count modulo 2³²; seconds here count from the first tick that this page has seen.
function addSpans(news) {
  for (const { tick, command, setpoint, encoder, inputs } of news) {
    if (firstTick === null) firstTick = tick;
    const second = ((tick - firstTick) >>> 0) / facts.tick_hz;
    const mm = (extent) => extent && extent.map((nm) => nm / 1e6);
    if (second < newestSecond - 1) spans = [];
    newestSecond = second;
    spans.push({ second, command: mm(command), setpoint: mm(setpoint), encoder: mm(encoder), inputs });
  }
  const old = spans.findIndex((span) => span.second >= newestSecond - LONGEST_S - 1);
  if (old > 200) spans.splice(0, old);
}

// ---- what is shown ----

function badge(words, kind) {
  by("link").textContent = words;
  by("link").dataset.kind = kind;
}

const mm = (nm) => (nm / 1e6).toFixed(3);

function show(id, words) {
  if (by(id).textContent !== words) by(id).textContent = words;
}

let isDrawn = 0;
function draw() {
  if (!frame || !facts || frame.number === isDrawn) return;
  isDrawn = frame.number;
  show("command", mm(frame.command_nm));
  show("setpoint", mm(frame.setpoint_nm));
  show("encoder", frame.encoder_nm === null ? "none" : `${mm(frame.encoder_nm)} mm`);
  show("state", frame.state);
  show("drive", frame.drive.state);
  showDrive();
  const seconds = Number(by("seconds").value);
  const length = spanSeconds();
  drawTimes(by("chart"), spans, newestSecond, seconds, 1.5 * length + 0.02);
  drawInputs(by("inputs"), spans, newestSecond, seconds, length);
  const kept = (frame.kept_samples * facts.ticks_per_sample) / facts.tick_hz;
  show("kept", `${kept.toFixed(1)} s, ${frame.kept_samples} samples`);
  show("lost", frame.lost_samples ? `${frame.lost_samples} lost on the way` : "none lost");
  showWay();
  showSwing();
  growResponse();
}

function spanSeconds() {
  return Math.max(1, Math.round(facts.tick_hz / facts.ticks_per_sample / 120)) * (facts.ticks_per_sample / facts.tick_hz);
}

function showDrive() {
  const { state, lacking, fault } = frame.drive;
  const hasFault = fault && fault !== "none";
  if (hasFault) badge(`fault: ${fault}`, "alarm");
  else badge(state === "enabled" ? `enabled, ${frame.state}` : state, state === "enabled" ? "good" : "quiet");
  show("lacking", state === "not_ready" && lacking ? `Before it can be enabled: ${lacking}.` : "");
  by("enable").disabled = !controls || !["disabled", "not_ready"].includes(state);
  by("disable").disabled = !controls || !["enabled", "enabling"].includes(state);
  by("clear").disabled = !controls || !hasFault;
  for (const id of ["anew", "save", "bypass"]) by(id).disabled = !controls;
  by("move").querySelector("button").disabled = !controls || state !== "enabled" || !AT_REST.includes(frame.state);
  by("sweep").querySelector("button").disabled = by("move").querySelector("button").disabled;
  by("shaper").querySelector("button").disabled = !controls;
  const others = frame.pages - 1;
  const company = others > 0 ? `${others} other page${others > 1 ? "s" : ""} open. ` : "";
  const role = controls ? "This page controls." : frame.is_controlled ? "Another page controls." : "Nobody controls.";
  show("control-state", company + role);
  by("control").disabled = !page || (!controls && frame.is_controlled);
}

// How far a move goes, before it goes.
function showWay() {
  const [from, to] = [frame.command_nm / 1e6, by("target").valueAsNumber];
  const [least, most] = facts.settings.travel_mm;
  if (Number.isNaN(to)) return show("way", "Say where to go.");
  const far = Math.abs(to - from);
  const side = to > from ? "forwards" : "backwards";
  const leaves = to < least || to > most ? ` That is outside the travel of ${least} to ${most} mm, so the board will refuse it.` : "";
  if (far < 1e-6) return show("way", `The axis is at ${from.toFixed(3)} mm already.`);
  return show("way", `Goes ${far.toFixed(3)} mm ${side}, from ${from.toFixed(3)} mm to ${to.toFixed(3)} mm.${leaves}`);
}

function setControl(has) {
  controls = has;
  by("control").setAttribute("aria-pressed", String(has));
  by("control").textContent = has ? "Give up control" : "Take control";
  if (frame && facts) showDrive();
}

// ---- what a person does ----

function listen() {
  for (const group of modeFields()) {
    for (const kind of ["off", ...KINDS]) field(group, "kind").add(new Option(kind, kind));
  }
  by("stop").addEventListener("click", stop);
  by("control").addEventListener("click", async () => {
    const result = await order(controls ? "control/release" : "control", {});
    if (result.ok) setControl(!controls);
  });
  by("enable").addEventListener("click", () => order("order", { order: "enable" }, "The drive is enabled."));
  by("disable").addEventListener("click", () => order("order", { order: "disable" }, "The drive is switched off."));
  by("clear").addEventListener("click", () => order("order", { order: "clear" }, "The fault is forgotten."));
  by("bypass").addEventListener("click", () => order("order", { order: "bypass" }, "Commands are passed through."));
  by("anew").addEventListener("click", () => order("recording/anew", {}, "The recording begins now."));
  by("save").addEventListener("click", async () => {
    const result = await order("recording/save", {});
    if (result.ok) by("saved").textContent = result.answer.told;
  });
  by("move").addEventListener("submit", (event) => {
    event.preventDefault();
    const [from_mm, to_mm] = [frame.command_nm / 1e6, by("target").valueAsNumber];
    const [velocity_mm_s, acceleration_mm_s2] = [by("velocity").valueAsNumber, by("acceleration").valueAsNumber];
    order("order", { order: "move", from_mm, to_mm, velocity_mm_s, acceleration_mm_s2 }, `Moving to ${to_mm} mm.`);
  });
  by("sweep").addEventListener("submit", (event) => {
    event.preventDefault();
    const [from_hz, to_hz, seconds, amplitude_mm] = sweepFields();
    const from_mm = frame.command_nm / 1e6;
    order("order", { order: "sweep", from_mm, from_hz, to_hz, seconds, amplitude_mm }, `Sweeping for ${seconds} s.`);
  });
  by("shaper").addEventListener("submit", (event) => {
    event.preventDefault();
    const modes = askedModes();
    if (modes.length) order("order", { order: "apply", modes }, "The shaper runs.");
    else order("order", { order: "bypass" }, "Commands are passed through.");
  });
  by("shaper").addEventListener("input", previewSoon);
  by("target").addEventListener("input", () => frame && facts && showWay());
  const redraw = () => {
    isDrawn = 0;
    if (!by("response").hidden) grown.sweeping = true;
    requestAnimationFrame(draw);
    previewSoon();
  };
  window.addEventListener("resize", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  // Esc stops wherever the cursor is; the space bar where it does not type, press or choose something else.
  document.addEventListener("keydown", (event) => {
    const element = document.activeElement;
    const isUsed = element && ["INPUT", "SELECT", "BUTTON"].includes(element.tagName) && element !== by("stop");
    if (event.key === "Escape" || (event.key === " " && !isUsed)) {
      event.preventDefault();
      if (!event.repeat) stop();
    }
  });
}

listen();
connect();
setInterval(here, 1000);
