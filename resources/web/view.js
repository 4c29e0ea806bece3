// The page: receives states, shows the hands, looks around them, and enters VR or AR. It sends nothing.
import * as THREE from "./three.module.min.js";
import { Hand } from "./hand.js";

const RETRY_MS = 1000;
const SILENT_MS = 1000; // without a state for so long, none is coming
const IN_FRONT = new THREE.Vector3(0, -0.2, -0.5); // of the head, where a headset shows the hand, m
const WORDS = { TRACKING: "Tracking", PARTIAL: "Partly seen", LOST: "Lost", SEARCHING: "Searching" };

const element = (id) => document.getElementById(id);
const canvas = element("scene");
const view = { received: 0, rate: 0, frames: 0, xrFrames: 0, hands: {}, session: null }; // for whoever inspects the page
window.rhot = view;

// --- the scene

let renderer = null;
try {
  renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
} catch (error) {
  complain("This browser shows no WebGL, so the hand cannot be drawn. Allow hardware acceleration, or use another one.");
  throw error;
}
renderer.xr.enabled = true;
renderer.xr.setReferenceSpaceType("local");
const scene = new THREE.Scene();
const night = new THREE.Color(0x14171c);
scene.background = night;
const camera = new THREE.PerspectiveCamera(45, 1, 0.01, 20);
const room = new THREE.Group(); // everything that is tracked
const grid = new THREE.GridHelper(1, 10, 0x4a5462, 0x2a313b);
room.add(grid);
scene.add(room, new THREE.HemisphereLight(0xffffff, 0x50565f, 2.2));
const sun = new THREE.DirectionalLight(0xffffff, 1.8);
sun.position.set(0.5, 1, 0.8);
scene.add(sun);

// --- looking around

const target = new THREE.Vector3(0, 0, -0.5);
const front = { azimuth: 0.35, elevation: 0.25, distance: 0.4 };
const orbit = { ...front };
const pointers = new Map();
let placed = false;

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, [event.clientX, event.clientY]);
});
for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
}
canvas.addEventListener("pointermove", (event) => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const spread = pinch();
  pointers.set(event.pointerId, [event.clientX, event.clientY]);
  if (pointers.size === 1) {
    orbit.azimuth -= 0.008 * (event.clientX - before[0]);
    orbit.elevation = clamp(orbit.elevation + 0.008 * (event.clientY - before[1]), -1.5, 1.5);
  } else if (spread > 0) {
    zoom(spread / pinch());
  }
});
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(0.001 * event.deltaY));
}, { passive: false });
canvas.addEventListener("dblclick", () => Object.assign(orbit, front));

function pinch() {
  const [a, b] = [...pointers.values()];
  return a && b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
}

function zoom(factor) {
  orbit.distance = clamp(orbit.distance * factor, 0.1, 5);
}

function clamp(value, low, high) {
  return Math.min(Math.max(value, low), high);
}

function look() {
  const { azimuth, elevation, distance } = orbit;
  camera.position.set(Math.sin(azimuth) * Math.cos(elevation), Math.sin(elevation),
    Math.cos(azimuth) * Math.cos(elevation)).multiplyScalar(distance).add(target);
  camera.lookAt(target);
}

// --- states

let newest = null;
let heardAt = -Infinity;
let refusals = 0; // since it was last connected

function connect() {
  const address = new URL("states", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  const socket = new WebSocket(address);
  socket.onopen = () => {
    if (refusals) element("notice").hidden = true;
    refusals = 0;
  };
  socket.onmessage = (event) => {
    newest = JSON.parse(event.data);
    heardAt = performance.now();
    view.received += 1;
  };
  socket.onclose = (event) => {
    if (event.code === 1006 && ++refusals > 1) {
      complain("The engine does not answer at this address. If it was started anew, it has printed another one.");
    }
    setTimeout(connect, RETRY_MS);
  };
}

function show(state) {
  const seen = new Set();
  for (const hand of state.hands) {
    seen.add(hand.name);
    let shown = view.hands[hand.name];
    if (shown && !shown.fits(hand.radii)) {
      room.remove(shown);
      shown.dispose();
      shown = null;
    }
    if (!shown) {
      shown = view.hands[hand.name] = new Hand(state.joints, hand.radii);
      room.add(shown);
    }
    shown.show(hand);
  }
  for (const [name, hand] of Object.entries(view.hands)) hand.visible &&= seen.has(name);
  follow();
}

// The first hand's middle is looked at; the picture follows slowly, so that movement is seen as such.
function follow() {
  const hand = Object.values(view.hands).find((one) => one.visible);
  if (!hand) return;
  const middle = hand.middle(new THREE.Vector3());
  target.lerp(middle, placed ? 0.02 : 1);
  grid.position.set(target.x, target.y - 0.15, target.z);
  placed = true;
}

function words() {
  const silent = performance.now() - heardAt > SILENT_MS;
  const condition = newest === null ? "Connecting" : WORDS[newest.hands[0].condition] ?? newest.hands[0].condition;
  element("condition").textContent = newest !== null && silent ? "No states come in" : condition;
  element("rate").textContent = silent ? "" : `${view.rate.toFixed(0)} states/s`;
}

let counted = 0;
setInterval(() => {
  view.rate = view.received - counted;
  counted = view.received;
  words();
}, 1000);

// --- headsets

async function offer(button, mode) {
  if (!(await navigator.xr?.isSessionSupported(mode).catch(() => false))) return;
  button.hidden = false;
  button.addEventListener("click", () => (view.session ? view.session.end() : enter(button, mode)));
}

async function enter(button, mode) {
  try {
    const session = await navigator.xr.requestSession(mode, { optionalFeatures: ["local-floor"] });
    await renderer.xr.setSession(session);
    const label = button.textContent;
    view.session = session;
    button.textContent = "Leave";
    scene.background = mode === "immersive-ar" ? null : night;
    grid.visible = mode !== "immersive-ar";
    room.position.copy(IN_FRONT).sub(target);
    session.addEventListener("end", () => {
      view.session = null;
      button.textContent = label;
      scene.background = night;
      grid.visible = true;
      room.position.set(0, 0, 0);
    });
  } catch (error) {
    complain(`The headset could not be entered: ${error.message}`);
  }
}

function complain(text) {
  element("notice").textContent = text;
  element("notice").hidden = false;
}

// --- every picture

function resize() {
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.setSize(window.innerWidth, window.innerHeight, false);
  camera.aspect = window.innerWidth / window.innerHeight;
  camera.updateProjectionMatrix();
}

window.addEventListener("resize", () => renderer.xr.isPresenting || resize());
resize();
let drawn = null;
renderer.setAnimationLoop((_time, frame) => {
  if (newest !== drawn) {
    drawn = newest;
    show(newest);
  }
  if (!renderer.xr.isPresenting) look();
  renderer.render(scene, camera);
  view.frames += 1;
  if (frame) view.xrFrames += 1;
});
if (!window.isSecureContext) {
  complain("This page was not opened by https or from this computer, so that no headset can be entered.");
}
offer(element("vr"), "immersive-vr");
offer(element("ar"), "immersive-ar");
connect();
