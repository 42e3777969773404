//! Equations of motion of a joint.
//!
//! ```text
//!   rigid:     (M + N² e J) q'' = N e τ_rotor + τ_out                 θ = N q
//!   flexible:  M q'' = τ + τ_out,   J θ'' = τ_rotor - τ/(N e),        τ = K (θ/N - q) + D (θ'/N - q')
//!   τ_rotor = τ_motor - friction,   τ_out = load + gravity + spring + stops - damping - friction
//! ```
//! `e` is the gear's efficiency, or one over it when the load drives (Spong, "Modeling and control of elastic joint
//! robots", ASME J. Dynamic Systems, Measurement, and Control 109, 1987, for the flexible joint).

use super::flexible::Flexible;
use super::friction::FrictionParameters;
use super::gear::{Flow, GearParameters};
use super::load::LoadParameters;
use super::mode::Slide;
use super::mode::{Mode, direction, slide};
use super::motor::JointMotorParameters;
use super::state::State;
use super::stops::{Contact, StopsParameters};
use super::winding::Winding;

/// Parts of a joint.
#[derive(Debug, Clone)]
pub(super) struct Mechanics {
    pub(super) load: LoadParameters,
    pub(super) stops: Option<StopsParameters>,
    pub(super) friction: FrictionParameters,
    pub(super) gear: GearParameters,
    pub(super) flexible: Option<Flexible>,
    pub(super) motor: JointMotorParameters,
    /// Linear motor model; `None` if steps are not exact.
    pub(super) winding: Option<Winding>,
    /// Inertia of the rotor side.
    pub(super) rotor_kg_m2: f64,
}

/// External inputs at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Inputs {
    /// Commanded torque.
    pub(super) wanted_nm: f64,
    /// On the output, `N m` or `N`.
    pub(super) load: f64,
    /// Maximum settling rate of the friction's bristles, `1/s`.
    pub(super) settling_max_per_s: f64,
}

/// Results of state and inputs.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rates {
    pub(super) state: State,
    /// From the drive on the output, `N m` or `N`.
    pub(super) force: f64,
    pub(super) voltage_v: f64,
}

/// Friction and damping against the output.
#[derive(Clone, Copy)]
struct Resistance {
    /// `N m` or `N`.
    force: f64,
    /// Rate of the bristle deflection.
    deflection_rate: f64,
}

/// Drive: transmitted force at the output, accelerations, and power loss.
struct Drive {
    force: f64,
    acceleration: f64,
    rotor_rad_per_s2: f64,
    lost_w: f64,
}

impl Mechanics {
    pub(super) fn start(&self) -> State {
        let position = self.load.start_position;
        State {
            position,
            rotor_rad: self.gear.ratio * position,
            winding_c: self.motor.start_c(),
            ..State::default()
        }
    }

    /// Position and velocity of the rotor, `rad` and `rad/s`.
    pub(super) fn rotor(&self, state: &State) -> (f64, f64) {
        if self.flexible.is_some() {
            (state.rotor_rad, state.rotor_rad_per_s)
        } else {
            (self.gear.ratio * state.position, self.gear.ratio * state.velocity)
        }
    }

    /// Stored energy in motion, springs, gravity and current, `J`.
    pub(super) fn stored_j(&self, state: &State) -> f64 {
        let (rotor_rad, rotor_rad_per_s) = self.rotor(state);
        let half_square = |factor: f64, value: f64| 0.5 * factor * value * value;
        let stretch = self.flexible.as_ref().map_or(0.0, |flexible| {
            let stretch = flexible.stretch(rotor_rad / self.gear.ratio - state.position);
            half_square(flexible.stiffness, stretch)
        });
        let stop = |stops: &StopsParameters| half_square(stops.stiffness, stops.beyond(state.position));
        half_square(self.load.inertia, state.velocity)
            + half_square(self.rotor_kg_m2, rotor_rad_per_s)
            + half_square(self.friction.presliding_stiffness, state.deflection)
            + self.stops.as_ref().map_or(0.0, stop)
            + stretch
            + self.load.potential_j(state.position)
            + self.motor.field_j(state)
    }

    /// Returns the mode of `state`.
    pub(super) fn mode(&self, inputs: &Inputs, state: &State) -> Mode {
        let stop =
            self.stops.as_ref().map_or(Contact::Free, |stops| stops.contact(state.position, state.velocity));
        let mut mode = Mode::free(stop);
        if let Some(flexible) = &self.flexible {
            let (twist, twist_rate) = self.twist(state);
            mode.mesh = flexible.mesh(twist, twist_rate);
            if self.is_rotor_dry() {
                mode.rotor = slide(state.rotor_rad_per_s, |rotor| {
                    self.drive(inputs, state, &Mode { rotor, ..mode }).rotor_rad_per_s2
                });
            }
        }
        if self.friction.is_dry() || (self.flexible.is_none() && self.is_rotor_dry()) {
            mode.output =
                slide(state.velocity, |output| self.acceleration(inputs, state, &Mode { output, ..mode }));
        }
        if self.gear.is_lossy() && mode.output != Slide::Stuck && self.is_exact() {
            mode.flow = Flow::of(self.transmitted(inputs, state, &mode) * direction(mode.output));
        }
        mode.is_limited = self.winding.as_ref().is_some_and(|winding| {
            let (_, rotor_rad_per_s) = self.rotor(state);
            !winding.follows(state, winding.current(inputs.wanted_nm, state), rotor_rad_per_s, 0.0)
        });
        mode
    }

    /// Of the output, in `mode`.
    pub(super) fn acceleration(&self, inputs: &Inputs, state: &State, mode: &Mode) -> f64 {
        self.drive(inputs, state, mode).acceleration
    }

    /// Whether the commanded force arrives at the output unchanged.
    pub(super) fn is_source(&self) -> bool {
        let is_ideal = self.motor == JointMotorParameters::default();
        is_ideal && self.flexible.is_none() && self.rotor_kg_m2 <= 0.0 && !self.gear.is_lossy()
    }

    /// Whether the rotor can stick by its friction or gear losses.
    fn is_rotor_dry(&self) -> bool {
        self.motor.coulomb_nm() > 0.0 || self.gear.is_lossy()
    }

    /// Returns the rates of the state in `mode`.
    pub(super) fn rates(&self, inputs: &Inputs, state: &State, mode: &Mode) -> Rates {
        let (_, rotor_rad_per_s) = self.rotor(state);
        let electric = self.motor.electric(inputs.wanted_nm, rotor_rad_per_s, state);
        let resistance = self.resistance(inputs, state, mode.output);
        let drive = self.drive_against(resistance.force, inputs, state, mode);
        let Resistance { force: resistance, deflection_rate } = resistance;
        let velocity = state.velocity;
        let bristles_w = self.friction.presliding_stiffness * state.deflection * deflection_rate;
        let stop_w = self.stops.as_ref().map_or(0.0, |stops| {
            let force = stops.force(mode.stop, state.position, velocity);
            -(force + stops.stiffness * stops.beyond(state.position)) * velocity
        });
        let (rotor_velocity, rotor_acceleration) = if self.flexible.is_some() {
            (state.rotor_rad_per_s, drive.rotor_rad_per_s2)
        } else {
            (0.0, 0.0)
        };
        let state = State {
            position: velocity,
            velocity: drive.acceleration,
            rotor_rad: rotor_velocity,
            rotor_rad_per_s: rotor_acceleration,
            deflection: deflection_rate,
            supplied_j: electric.supplied_w + inputs.load * velocity,
            dissipated_j: electric.lost_w + drive.lost_w + resistance * velocity - bristles_w + stop_w,
            ..electric.rates
        };
        Rates { state, force: drive.force, voltage_v: electric.voltage_v }
    }

    fn resistance(&self, inputs: &Inputs, state: &State, output: Slide) -> Resistance {
        let (friction, deflection_rate) = self.friction.resist(
            direction(output),
            state.velocity,
            state.deflection,
            inputs.settling_max_per_s,
        );
        Resistance { force: friction + self.load.damping * state.velocity, deflection_rate }
    }

    fn drive(&self, inputs: &Inputs, state: &State, mode: &Mode) -> Drive {
        self.drive_against(self.resistance(inputs, state, mode.output).force, inputs, state, mode)
    }

    fn drive_against(&self, resistance: f64, inputs: &Inputs, state: &State, mode: &Mode) -> Drive {
        let outer = self.outer(resistance, inputs, state, mode);
        let motor_nm = self.motor.torque_nm(inputs.wanted_nm, state);
        match &self.flexible {
            Some(flexible) => self.flexible_drive(flexible, state, mode, motor_nm, outer),
            None => self.rigid_drive(state, mode, motor_nm, outer),
        }
    }

    /// External force on the output.
    fn outer(&self, resistance: f64, inputs: &Inputs, state: &State, mode: &Mode) -> f64 {
        let stop = |stops: &StopsParameters| stops.force(mode.stop, state.position, state.velocity);
        inputs.load + self.load.potential_force(state.position) + self.stops.as_ref().map_or(0.0, stop)
            - resistance
    }

    /// Of a rigid joint: has the sign of the gear torque, independent of the efficiency.
    pub(super) fn transmitted(&self, inputs: &Inputs, state: &State, mode: &Mode) -> f64 {
        let resistance = self.resistance(inputs, state, mode.output).force;
        let outer = self.outer(resistance, inputs, state, mode);
        let turning = direction(mode.output);
        let net_nm = self.motor.torque_nm(inputs.wanted_nm, state)
            - self.rotor_resistance_nm(turning, self.gear.ratio * state.velocity);
        self.transmitted_by(net_nm, outer)
    }

    pub(super) fn transmitted_by(&self, net_nm: f64, outer: f64) -> f64 {
        net_nm * self.load.inertia - self.rotor_kg_m2 * self.gear.ratio * outer
    }

    fn rigid_drive(&self, state: &State, mode: &Mode, motor_nm: f64, outer: f64) -> Drive {
        let (ratio, inertia) = (self.gear.ratio, self.load.inertia);
        let turning = direction(mode.output);
        let rotor_rad_per_s = ratio * state.velocity;
        let resistance_nm = self.rotor_resistance_nm(turning, rotor_rad_per_s);
        let net_nm = motor_nm - resistance_nm;
        let efficiency = self.gear.transmission(self.transmitted_by(net_nm, outer), turning);
        let leverage = ratio * efficiency;
        let acceleration = if mode.output == Slide::Stuck {
            0.0
        } else {
            (leverage * net_nm + outer) / (inertia + leverage * ratio * self.rotor_kg_m2)
        };
        let rotor_rad_per_s2 = ratio * acceleration;
        let input_nm = net_nm - self.rotor_kg_m2 * rotor_rad_per_s2;
        let force = leverage * input_nm;
        let gear_w = input_nm * rotor_rad_per_s - force * state.velocity;
        Drive { force, acceleration, rotor_rad_per_s2, lost_w: gear_w + resistance_nm * rotor_rad_per_s }
    }

    fn flexible_drive(
        &self,
        flexible: &Flexible,
        state: &State,
        mode: &Mode,
        motor_nm: f64,
        outer: f64,
    ) -> Drive {
        let turning = direction(mode.rotor);
        let rotor_rad_per_s = state.rotor_rad_per_s;
        let (twist, twist_rate) = self.twist(state);
        let force = flexible.torque(mode.mesh, twist, twist_rate);
        let spring_w = (force - flexible.stiffness * flexible.stretch(twist)) * twist_rate;
        let reflected_nm = force / (self.gear.ratio * self.gear.transmission(force, turning));
        let gear_w = (reflected_nm - force / self.gear.ratio) * rotor_rad_per_s;
        let resistance_nm = self.rotor_resistance_nm(turning, rotor_rad_per_s);
        let rotor_rad_per_s2 = (motor_nm - resistance_nm - reflected_nm) / self.rotor_kg_m2;
        let acceleration = (force + outer) / self.load.inertia;
        Drive {
            force,
            acceleration: if mode.output == Slide::Stuck { 0.0 } else { acceleration },
            rotor_rad_per_s2: if mode.rotor == Slide::Stuck { 0.0 } else { rotor_rad_per_s2 },
            lost_w: spring_w + gear_w + resistance_nm * rotor_rad_per_s,
        }
    }

    /// Friction of the rotor, `N m`.
    fn rotor_resistance_nm(&self, turning: f64, rotor_rad_per_s: f64) -> f64 {
        turning * self.motor.coulomb_nm() + self.motor.viscous_nms_per_rad() * rotor_rad_per_s
    }

    /// Force of the flexible element at the output, and its rate.
    fn twist(&self, state: &State) -> (f64, f64) {
        let ratio = self.gear.ratio;
        (state.rotor_rad / ratio - state.position, state.rotor_rad_per_s / ratio - state.velocity)
    }
}
