// The 3D view of all devices of the page, next to each other.

import * as three from "./three.min.js";
import { node } from "./dom.js";
import { follow } from "./kinematics.js";
import { Robot } from "./robot.js";

// Type inference fails in the minified file.
const {
  Box3, Color, GridHelper, Group, HemisphereLight, DirectionalLight, OrbitControls, PerspectiveCamera, Plane, Raycaster, Scene, Sphere, Vector2, Vector3,
  WebGLRenderer,
} = /** @type {any} */ (three);

const FRAME_MS = 33;
/** A display's frame; a picture that takes longer is followed by a pause, for the presence messages of the page. */
const FAST_MS = 20, PAUSES = 4, MAX_PAUSE_MS = 500;
const dark = matchMedia("(prefers-color-scheme: dark)");
const HINT = "Drag a link, tip (sphere) or hand to move it; drag the background to turn the view. With the view selected: arrow keys turn, + and - zoom.";

export class Robots {
  /** `hold(station, axis, value, signal)` holds a reference or hand while the user drags, with null on release. */
  constructor(place, hold) {
    this.place = place;
    this.hold = hold;
    this.robots = [];
    this.sources = [];
    this.why = "";
    this.drawnAt = 0;
    this.pause_ms = FRAME_MS;
    this.isDrawn = false;
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    const canvas = this.canvas = this.renderer.domElement;
    Object.assign(canvas, { tabIndex: 0, title: HINT });
    canvas.setAttribute("role", "img");
    this.labels = node("div", { className: "labels" });
    place.replaceChildren(canvas, this.labels);
    this.camera = new PerspectiveCamera(35, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.ray = new Raycaster();
    // Before the listeners of the view control: a drag of a part must not turn the view.
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(kind, () => this.release());
    canvas.addEventListener("keydown", (event) => this.turn(event));
    this.controls = new OrbitControls(this.camera, canvas);
    // The wheel scrolls the page until the view is selected.
    this.controls.enableZoom = false;
    canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
    canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
    this.controls.addEventListener("change", () => { this.isDirty = true; });
    new ResizeObserver(() => this.resize()).observe(place);
    dark.addEventListener("change", () => this.show(this.stations, true));
    this.renderer.setAnimationLoop((now) => this.frame(now));
  }

  allow(why) { this.why = why; }

  /** Builds the devices of the stations, if they have changed. */
  show(stations, always = false) {
    this.stations = stations;
    const key = JSON.stringify(stations.map(({ geometry }) => geometry));
    if (key === this.key && !always) return;
    this.release();
    this.key = key;
    this.scene = new Scene();
    const style = getComputedStyle(document.body);
    const css = (name) => new Color(style.getPropertyValue(`--${name}`).trim());
    const colors = { link: css("link"), quiet: css("quiet"), warn: css("warn"), good: css("good"), hand: new Color("#c58c6b"), wall: new Color("#8a8f98") };
    const sun = new DirectionalLight(0xffffff, 2);
    sun.position.set(1, -2, 3);
    this.scene.add(new HemisphereLight(0xffffff, 0x888888, 1.6), sun);
    const byDevice = new Map();
    this.sources = stations.map(({ geometry }) => {
      if (!geometry) return null;
      if (!byDevice.has(geometry.device)) byDevice.set(geometry.device, new Robot(geometry, colors));
      return { robot: byDevice.get(geometry.device), axes: geometry.axes };
    });
    this.robots = [...byDevice.values()];
    this.place.hidden = !this.robots.length;
    if (!this.robots.length) return;
    // Beside each other, the first on the left as seen by the camera.
    let y = 0;
    const all = new Group();
    for (const robot of this.robots) {
      const half = robot.kind.tips.length > 1 ? 0.2 * robot.kind.tips.length : 0.8 * robot.size;
      robot.group.position.y = y - half;
      y -= 2 * half;
      all.add(robot.group);
    }
    this.scene.add(all);
    this.scene.updateMatrixWorld(true);
    const box = new Box3().setFromObject(all);
    for (const robot of this.robots) {
      const own = new Box3().setFromObject(robot.group);
      robot.foot = own.getCenter(new Vector3()).setZ(own.min.z);
    }
    this.extent = box.getBoundingSphere(new Sphere());
    const grid = new GridHelper(6 * this.extent.radius, 24, colors.quiet, colors.quiet);
    grid.rotation.x = Math.PI / 2;
    grid.position.set(this.extent.center.x, this.extent.center.y, box.min.z - 0.02 * this.extent.radius);
    Object.assign(grid.material, { transparent: true, opacity: 0.2 });
    this.scene.add(grid);
    this.canvas.setAttribute("aria-label", `3D view of ${this.robots.map(({ geometry }) => geometry.device).join(", ")}`);
    this.labels.replaceChildren(...this.robots.map(({ geometry }) => node("span", { textContent: geometry.device })));
    this.look();
    this.resize();
  }

  /** Shows all devices from the front right. */
  look() {
    this.controls.target.copy(this.extent.center);
    this.camera.position.copy(this.extent.center).add(new Vector3(0.55, -0.85, 0.45).setLength(3.3 * this.extent.radius));
    this.controls.update();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.isDirty = true;
  }

  /** Shows the last tick of a station. */
  move(station, signals, isCommanded) {
    const source = this.sources[station];
    if (!source || !signals) return;
    source.robot.move(source, signals, isCommanded);
    this.isDirty = true;
  }

  frame(now) {
    if (this.isDrawn) {
      const took_ms = now - this.drawnAt;
      this.pause_ms = took_ms <= FAST_MS ? FRAME_MS : Math.min(MAX_PAUSE_MS, PAUSES * took_ms);
      this.isDrawn = false;
    }
    if (!this.isDirty || !this.robots.length || now - this.drawnAt < this.pause_ms || !this.place.clientWidth) return;
    [this.isDirty, this.drawnAt, this.isDrawn] = [false, now, true];
    for (const robot of this.robots) robot.pose();
    this.renderer.render(this.scene, this.camera);
    this.robots.forEach((robot, n) => {
      const at = robot.foot.clone().project(this.camera);
      const label = /** @type {HTMLElement} */ (this.labels.children[n]);
      label.style.transform = `translate(-50%, 0) translate(${((at.x + 1) * this.place.clientWidth) / 2}px, ${((1 - at.y) * this.place.clientHeight) / 2}px)`;
    });
  }

  aim(event) {
    const box = this.canvas.getBoundingClientRect();
    this.ray.setFromCamera(new Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height), this.camera);
  }

  grab(event) {
    if (event.button || !event.isPrimary) return;
    this.aim(event);
    const hit = this.robots.length && this.ray.intersectObject(this.scene, true).find(({ object }) => object.userData.robot);
    if (!hit || !hit.object.userData.drag || this.why) return;
    const { robot, drag } = hit.object.userData;
    // The point on the body that follows the pointer; a tip follows with its centre.
    const body = robot.solid[drag.body];
    const own = drag.point ?? body.worldToLocal(hit.point.clone()).toArray();
    const start = body.localToWorld(new Vector3(...own));
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new Vector3()), start);
    this.dragged = { robot, ...drag, own, plane, positions: [...robot.positions], offset: start.sub(hit.point) };
    this.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
  }

  drag(event) {
    if (!this.dragged) return;
    if (this.why || !event.buttons) return this.release();
    const { robot, plane, body, own, axes, signal, positions, offset } = this.dragged;
    this.aim(event);
    const hit = this.ray.ray.intersectPlane(plane, new Vector3());
    if (!hit) return;
    const target = robot.group.worldToLocal(hit.add(offset)).toArray();
    if (signal === "hand" && robot.kind.origin) {
      for (const axis of axes) this.send(robot, signal, axis, target[axis] - robot.kind.origin[axis]);
      return;
    }
    this.dragged.positions = follow(robot.kind, positions, axes, { body, point: own }, target);
    for (const axis of axes) this.send(robot, signal, axis, this.dragged.positions[axis]);
  }

  release() {
    if (!this.dragged) return;
    const { robot, signal, axes } = this.dragged;
    this.dragged = null;
    this.controls.enabled = true;
    for (const axis of axes) this.send(robot, signal, axis, null);
  }

  /** Sends a value of an axis of a device to the controller of this axis. */
  send(robot, signal, axis, value) {
    this.sources.forEach((source, station) => {
      const own = source?.robot === robot ? source.axes.indexOf(axis) : -1;
      if (own >= 0) this.hold(station, own, value, signal);
    });
  }

  turn(event) {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1], "+": [0, 0, 0.9], "-": [0, 0, 1.1] }[event.key];
    if (!turns) return;
    event.preventDefault();
    const [around, up, zoom = 1] = turns, away = this.camera.position.clone().sub(this.controls.target);
    const height = Math.asin(away.z / away.length()), heading = Math.atan2(away.y, away.x) + around, length = zoom * away.length();
    const raised = Math.max(-1.4, Math.min(1.4, height + up));
    away.set(Math.cos(raised) * Math.cos(heading), Math.cos(raised) * Math.sin(heading), Math.sin(raised)).multiplyScalar(length);
    this.camera.position.copy(this.controls.target).add(away);
    this.controls.update();
  }
}
