"use strict";
// The panels of the page that show what the server computes: the shaper while it is changed, and the response
// while a sweep runs. What they share with page.js is there.

// ---- the shaper and the limits ----

const modeFields = () => [...document.querySelectorAll("[data-mode]")];
const field = (group, name) => group.querySelector(`[name="${name}"]`);

function fill(settings) {
  by("velocity").value = settings.velocity_mm_s;
  by("acceleration").value = settings.acceleration_mm_s2;
  modeFields().forEach((group, place) => {
    const mode = settings.modes[place];
    field(group, "kind").value = mode.kind;
    field(group, "frequency_hz").value = mode.frequency_hz;
    field(group, "damping_ratio").value = mode.damping_ratio;
  });
  const runs = settings.shaper === "off" || !settings.shaper_duration_ms;
  by("applied").textContent = runs ? "On the board: no shaper." : `On the board: a shaper of ${settings.shaper_duration_ms.toFixed(1)} ms.`;
  preview();
}

function askedModes() {
  const read = (group) => ({
    kind: field(group, "kind").value,
    frequency_hz: field(group, "frequency_hz").valueAsNumber,
    damping_ratio: field(group, "damping_ratio").valueAsNumber,
  });
  return modeFields().map(read).filter((mode) => mode.kind !== "off");
}

let previews = 0;
async function preview() {
  previews += 1;
  const mine = previews;
  const modes = askedModes();
  for (const group of modeFields()) {
    const isOff = field(group, "kind").value === "off";
    for (const name of ["frequency_hz", "damping_ratio"]) field(group, name).disabled = isOff;
  }
  if (!modes.length) {
    drawSensitivity(by("sensitivity"), [], []);
    return show("expected", "Choose a kind for a mode to see what it leaves.");
  }
  const result = await ask("preview", { modes });
  if (mine !== previews) return undefined;
  if (!result.ok) return show("expected", result.refused);
  const told = result.answer;
  drawSensitivity(by("sensitivity"), told.curve, modes.map((mode) => mode.frequency_hz));
  const s = (seconds) => `${seconds.toFixed(seconds < 10 ? 3 : 1)} s`;
  return show(
    "expected",
    `Still ${s(told.settling_s)} after the command ends (to 2 % of the unshaped vibration); ${s(told.settling_if_off_s)} if a frequency ` +
      `is 5 % off; ${s(told.settling_unshaped_s)} without a shaper. The shaper lasts ${s(told.duration_s)} and delays by ${s(told.delay_s)}.`,
  );
}

let waiting = 0;
function previewSoon() {
  clearTimeout(waiting);
  waiting = setTimeout(preview, 120);
}

// ---- the sweep ----

// How far a sweep swings, before it does.
function showSwing() {
  const [from, to, seconds, amplitude] = sweepFields();
  const around = (frame.command_nm / 1e6).toFixed(3);
  const isWhole = [from, to, seconds, amplitude].every((number) => number > 0);
  show("swing", isWhole ? `Swings ±${amplitude} mm around ${around} mm, from ${from} Hz to ${to} Hz, for ${seconds} s.` : "Fill in all four.");
}

const sweepFields = () => ["from", "to", "seconds", "amplitude"].map((name) => by(`sweep-${name}`).valueAsNumber);

// While a sweep runs, and once after it: what it has shown so far.
let grown = { at: 0, sweeping: false, asking: false };
async function growResponse() {
  const sweeping = frame.state === "sweeping";
  const isDue = sweeping ? performance.now() - grown.at > 700 : grown.sweeping;
  if (!isDue || grown.asking) return;
  grown = { at: performance.now(), sweeping, asking: true };
  const result = await ask("response");
  grown.asking = false;
  if (!result.ok) return show("response-told", result.refused);
  const { curve, reached_hz, band_hz } = result.answer;
  by("response").hidden = false;
  drawResponse(by("response"), curve, [Math.min(...band_hz), Math.max(...band_hz)]);
  return show("response-told", `Encoder over setpoint, ${sweeping ? `so far to ${reached_hz.toFixed(2)} Hz` : "the whole sweep"}.`);
}
