// One device in 3D: its bodies at the measured position, a ghost at the reference, forces, wall and hand.

import * as three from "./three.min.js";
import { mechanism } from "./kinematics.js";

// Type inference fails in the minified file.
const {
  ArrowHelper, BoxGeometry, CylinderGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry, TorusGeometry, Vector3,
} = /** @type {any} */ (three);

const FULL_ARC_RAD = 1.6;
const Y = new Vector3(0, 1, 0), Z = new Vector3(0, 0, 1);

export class Robot {
  /** `colors` are CSS colors by name. */
  constructor(geometry, colors) {
    const kind = mechanism(geometry);
    this.geometry = geometry;
    this.kind = kind;
    this.group = new Group();
    this.size = Math.max(0.01, kind.reach);
    this.positions = geometry.axis.map(({ start_position }) => start_position);
    this.references = [...this.positions];
    this.lastForces = geometry.axis.map(() => 0);
    this.largestForce = geometry.axis.map(() => 1e-6);
    const material = (name, opacity = 1) => new MeshStandardMaterial({ color: colors[name], transparent: opacity < 1, opacity, roughness: 0.6 });
    this.solid = this.bodies(material("link"), material("quiet"), false);
    this.ghost = this.bodies(material("warn", 0.35), material("warn", 0.35), true);
    for (const { body, point, axes } of kind.tips) {
      this.add(this.ghost[body], new SphereGeometry(0.06 * this.size), material("warn", 0.8), point, { axes, body, point, signal: "DES_POSITION" });
      this.add(this.solid[body], new SphereGeometry(0.045 * this.size), material("link"), point, { axes, body, point, signal: "DES_POSITION" });
    }
    this.addHands(material("hand"));
    this.addWalls(material("wall", 0.6));
    this.forces = kind.isCartesian ? [this.tipForce(colors)] : kind.axes.map((axis) => this.axisForce(axis, colors));
    this.pose();
  }

  /** Adds a mesh to a body; `drag` makes it draggable. */
  add(body, shape, material, place, drag) {
    const mesh = new Mesh(shape, material);
    mesh.position.set(...place);
    Object.assign(mesh.userData, { robot: this, drag });
    body.add(mesh);
    return mesh;
  }

  /** Creates all bodies: rods, and a hub at each axis. Dragging a link moves the axis before it. */
  bodies(links, hubs, isGhost) {
    const { kind } = this, radius = 0.024 * this.size;
    const bodies = kind.poses(this.positions).map(() => new Group());
    for (const body of bodies) {
      body.matrixAutoUpdate = false;
      this.group.add(body);
    }
    const axisOf = (body) => kind.axes.findLastIndex((axis) => axis.body === body);
    for (const { body, from, to } of kind.rods) {
      const axis = axisOf(body), along = new Vector3(...to).sub(new Vector3(...from));
      if (isGhost && axis < 0) continue;
      const middle = from.map((value, i) => (value + to[i]) / 2);
      const drag = axis >= 0 && !kind.isCartesian && { axes: [axis], body, signal: "DES_POSITION" };
      const mesh = this.add(bodies[body], new CylinderGeometry(radius, radius, along.length(), 16), links, middle, drag || undefined);
      mesh.quaternion.setFromUnitVectors(Y, along.normalize());
    }
    if (isGhost) return bodies;
    for (const { body, direction, isRotary } of kind.axes) {
      const shape = isRotary ? new CylinderGeometry(1.7 * radius, 1.7 * radius, 4 * radius, 24) : new BoxGeometry(4 * radius, 4 * radius, 4 * radius);
      this.add(bodies[body], shape, hubs, [0, 0, 0]).quaternion.setFromUnitVectors(Y, new Vector3(...direction));
    }
    return bodies;
  }

  /** Adds the hand at each tip that has one; dragging a hand moves its intended position. */
  addHands(material) {
    const { kind } = this;
    for (const { body, point, axes } of kind.tips) {
      const held = axes.filter((axis) => this.geometry.axis[axis].has_hand);
      if (!held.length) continue;
      const drag = { axes: held, body, point, signal: "hand" };
      const hand = this.add(this.solid[body], new SphereGeometry(0.11 * this.size, 24, 16), material, point, drag);
      hand.scale.set(1, 1.3, 0.8);
    }
  }

  addWalls(material) {
    const { kind, size } = this, home = kind.poses(this.positions);
    this.geometry.axis.forEach(({ wall, unit }, axis) => {
      if (!wall) return;
      const thick = 0.15 * size, wide = 1.2 * size, middle = wall.position + (wall.solid === "above" ? 1 : -1) * thick / 2;
      if (kind.origin) {
        const box = new Mesh(new BoxGeometry(...[0, 1, 2].map((i) => (i === axis ? thick : wide))), material);
        box.position.set(...kind.origin.map((value, i) => value + (i === axis ? middle : 0)));
        this.group.add(box);
      } else if (unit === "m" && !this.geometry.arm) {
        const box = new Mesh(new BoxGeometry(thick, wide / 2, wide), material);
        const [x, y, z] = home[2 * axis].slice(12, 15);
        // The surface touches the block of the axis, not its centre.
        box.position.set(x + middle + (wall.solid === "above" ? 1 : -1) * 0.07 * size, y, z);
        this.group.add(box);
      } else if (!this.geometry.arm && !this.geometry.phantom) {
        const bar = new Mesh(new BoxGeometry(0.5 * size, 0.2 * size, 0.03 * size), material);
        const [x, y, z] = home[2 * axis].slice(12, 15);
        bar.position.set(x + size * Math.cos(wall.position), y, z + size * Math.sin(wall.position));
        bar.rotation.y = -wall.position;
        this.group.add(bar);
      }
    });
  }

  /** An arc around a rotary axis, or an arrow along a linear axis. */
  axisForce({ body, direction, isRotary }, colors) {
    const along = new Vector3(...direction);
    if (!isRotary) return this.arrow(this.solid[body], () => along, colors);
    const arc = new Mesh(undefined, new MeshStandardMaterial({ color: colors.good, transparent: true }));
    // A torus is around z.
    arc.quaternion.copy(new Quaternion().setFromUnitVectors(Z, along));
    this.solid[body].add(arc);
    let last = null;
    return (share, _, opacity) => {
      arc.visible = Math.abs(share) > 0.01;
      arc.material.opacity = opacity;
      arc.scale.y = Math.sign(share) || 1;
      if (last !== null && Math.abs(share - last) < 0.01) return;
      last = share;
      arc.geometry.dispose();
      arc.geometry = new TorusGeometry(0.11 * this.size, 0.012 * this.size, 8, 24, FULL_ARC_RAD * Math.max(0.01, Math.abs(share)));
    };
  }

  /** The force vector at the tip. */
  tipForce(colors) {
    const show = this.arrow(this.group, (forces) => new Vector3(...forces), colors, () => this.tip());
    return (_, forces, opacity) => show(Math.hypot(...forces) / Math.max(...this.largestForce), forces, opacity);
  }

  arrow(body, direction, colors, place = () => new Vector3()) {
    const arrow = new ArrowHelper(new Vector3(1, 0, 0), new Vector3(), 0.1, colors.good);
    for (const part of [arrow.line, arrow.cone]) part.material.transparent = true;
    body.add(arrow);
    return (share, forces, opacity) => {
      const length = 0.6 * this.size * Math.abs(share);
      arrow.visible = length > 1e-3 * this.size;
      if (!arrow.visible) return;
      arrow.position.copy(place());
      arrow.setDirection(direction(forces).multiplyScalar(Math.sign(share)).normalize());
      arrow.setLength(length, 0.12 * this.size, 0.06 * this.size);
      for (const part of [arrow.line, arrow.cone]) part.material.opacity = opacity;
    };
  }

  /** The measured tip in the frame of the group. */
  tip() {
    const { body, point } = this.kind.tips[0];
    return new Vector3(...point).applyMatrix4(this.solid[body].matrix);
  }

  /** Shows the last tick of a controller's axes. */
  move({ axes }, signals, isCommanded) {
    const values = (name) => signals.get(name)?.values ?? [];
    axes.forEach((axis, n) => {
      const [is, wanted, force] = ["POSITION", "DES_POSITION", "DES_FORCE"].map((name) => values(name)[n]);
      if (Number.isFinite(is)) this.positions[axis] = is;
      this.references[axis] = Number.isFinite(wanted) ? wanted : this.positions[axis];
      this.lastForces[axis] = Number.isFinite(force) ? force : 0;
      this.largestForce[axis] = Math.max(this.largestForce[axis], Math.abs(this.lastForces[axis]));
    });
    this.opacity = isCommanded ? 1 : 0.2;
    const distance = this.references.map((value, axis) => Math.abs(value - this.positions[axis]));
    this.hasReference = values("DES_POSITION").length > 0 && Math.max(...distance) > 1e-6;
  }

  /** Applies the last values to the picture. */
  pose() {
    const set = (bodies, positions) => this.kind.poses(positions).forEach((pose, body) => {
      bodies[body].matrix.fromArray(pose);
      bodies[body].matrixWorldNeedsUpdate = true;
    });
    set(this.solid, this.positions);
    for (const body of this.ghost) body.visible = Boolean(this.hasReference);
    if (this.hasReference) set(this.ghost, this.references);
    const forces = this.lastForces;
    this.forces.forEach((show, axis) => show(forces[axis] / this.largestForce[axis], forces, this.opacity ?? 0.2));
  }
}
