//! What a vehicle is made of: suspension, tyres, wheels, anti-roll bars. Numbers only, with their units and defaults.

use crate::error::{Error, finite_vec, in_range, unit_vec};
use crate::math::{Real, Vec3};
use crate::world::{CombineRule, QueryFilter};

/// A spring with a damper between the chassis and a wheel.
///
/// The stiffness is `m (2π f)²` and the damping `2 ζ m (2π f)`, where `m` is the mass of the chassis divided by the
/// number of its wheels. A car at rest therefore sinks by about `g / (2π f)²`: 9 cm at the default frequency.
///
/// ```
/// use arbiter3d::Suspension;
/// let sporty = Suspension { frequency: 2.5, travel: 0.12, ..Suspension::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspension {
    /// Distance from the attachment to the centre of the wheel when the spring carries nothing, metres (0 to 10³).
    /// Default 0.35.
    pub rest_length: Real,
    /// How far the wheel can rise from there before it meets the bump stop, metres; above 0 and at most 10³. The stop
    /// is a spring 20 times as stiff. Default 0.25.
    pub travel: Real,
    /// Frequency of the undamped spring under its share of the chassis, Hz (above 0, at most 100): 1 to 1.5 is soft, 3
    /// is stiff. Default 1.7.
    pub frequency: Real,
    /// Damping ratio, 0 to 10; 1 does not swing back. Default 0.5.
    pub damping_ratio: Real,
    /// The most that the strut carries, N (0 to 10⁹). Default 10⁵.
    pub max_force: Real,
}

impl Default for Suspension {
    fn default() -> Self {
        Self { rest_length: 0.35, travel: 0.25, frequency: 1.7, damping_ratio: 0.5, max_force: 1e5 }
    }
}

/// How a tyre grips: the force over the slip, and how much there is of it.
///
/// Slip along the wheel is the slip speed as a share of the speed (of the ground or of the tread, whichever is faster),
/// slip across it the tangent of the slip angle. Divided by its peak value, the force rises in proportion up to 1, then
/// falls in proportion to `sliding_grip` at `sliding_slip`, and stays there. Both directions share one friction circle.
/// At a standstill the tyre sticks.
///
/// ```
/// use arbiter3d::Tyre;
/// let rain = Tyre { friction: 0.6, sliding_grip: 0.7, ..Tyre::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tyre {
    /// Largest force as a share of the load, 0 or more. Default 1.
    pub friction: Real,
    /// How it is combined with the friction of the ground. Default the maximum, so that the tyre decides unless the
    /// ground's material has a stricter rule: let ice combine by [`CombineRule::Minimum`].
    pub friction_combine: CombineRule,
    /// Slip along the wheel at which the force is largest, 0.001 to 10. Default 0.1.
    pub longitudinal_peak: Real,
    /// Slip across the wheel at which the force is largest, 0.001 to 10. Default 0.12, a slip angle of 7°.
    pub lateral_peak: Real,
    /// Force of a tyre that slides as a share of the largest, 0 to 1. Default 0.8.
    pub sliding_grip: Real,
    /// From how many times the peak slip on it slides, above 1, at most 10³. Default 5.
    pub sliding_slip: Real,
    /// Resistance to rolling as a share of the load, 0 to 1. Default 0.01.
    pub rolling_resistance: Real,
}

impl Default for Tyre {
    fn default() -> Self {
        Self {
            friction: 1.0,
            friction_combine: CombineRule::Maximum,
            longitudinal_peak: 0.1,
            lateral_peak: 0.12,
            sliding_grip: 0.8,
            sliding_slip: 5.0,
            rolling_resistance: 0.01,
        }
    }
}

impl Tyre {
    /// The largest force at this slip (in peaks) as a share of the largest of all: 1 up to the peak.
    pub(super) fn grip_at(&self, slip: Real) -> Real {
        let past = crate::math::clamp((slip - 1.0) / (self.sliding_slip - 1.0), 0.0, 1.0);
        1.0 - past * (1.0 - self.sliding_grip)
    }
}

/// A wheel of a vehicle.
///
/// ```
/// use arbiter3d::{WheelDefinition, math::Vec3};
/// let front_left = WheelDefinition { steered: true, ..WheelDefinition::at(Vec3::new(-0.8, -0.2, -1.4)) };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelDefinition {
    /// Upper end of the suspension in the frame of the chassis, metres. Default zero.
    pub attachment: Vec3,
    /// Radius, metres (10⁻³ to 10³). Default 0.35.
    pub radius: Real,
    /// Moment of inertia about the axle, kg m² (10⁻⁶ to 10⁹). Default 1.2, a wheel of 20 kg.
    pub inertia: Real,
    /// The strut.
    pub suspension: Suspension,
    /// The tyre.
    pub tyre: Tyre,
    /// Whether it is steered. Default false.
    pub steered: bool,
    /// Its share of the vehicle's drive torque, −10 to 10. Default 0.
    pub drive_share: Real,
    /// Torque of the brake when fully applied, N m (0 to 10⁹). Default 3000, which locks the wheel of a car.
    pub brake_torque: Real,
    /// Torque of the handbrake when fully applied, N m (0 to 10⁹). Default 0.
    pub handbrake_torque: Real,
}

impl Default for WheelDefinition {
    fn default() -> Self {
        Self {
            attachment: Vec3::ZERO,
            radius: 0.35,
            inertia: 1.2,
            suspension: Suspension::default(),
            tyre: Tyre::default(),
            steered: false,
            drive_share: 0.0,
            brake_torque: 3000.0,
            handbrake_torque: 0.0,
        }
    }
}

impl WheelDefinition {
    /// A wheel of the default kind whose suspension is attached here, metres in the frame of the chassis.
    #[must_use]
    pub fn at(attachment: Vec3) -> Self {
        Self { attachment, ..Self::default() }
    }

    fn validate(&self) -> Result<(), Error> {
        finite_vec("wheel attachment", self.attachment)?;
        in_range("wheel radius", self.radius, 1e-3, 1e3)?;
        in_range("wheel inertia", self.inertia, 1e-6, 1e9)?;
        in_range("drive_share", self.drive_share, -10.0, 10.0)?;
        in_range("brake_torque", self.brake_torque, 0.0, 1e9)?;
        in_range("handbrake_torque", self.handbrake_torque, 0.0, 1e9)?;
        let suspension = &self.suspension;
        in_range("suspension rest_length", suspension.rest_length, 0.0, 1e3)?;
        in_range("suspension travel", suspension.travel, 1e-6, 1e3)?;
        in_range("suspension frequency", suspension.frequency, 1e-3, 100.0)?;
        in_range("suspension damping_ratio", suspension.damping_ratio, 0.0, 10.0)?;
        in_range("suspension max_force", suspension.max_force, 0.0, 1e9)?;
        let tyre = &self.tyre;
        in_range("tyre friction", tyre.friction, 0.0, 1e3)?;
        in_range("tyre longitudinal_peak", tyre.longitudinal_peak, 1e-3, 10.0)?;
        in_range("tyre lateral_peak", tyre.lateral_peak, 1e-3, 10.0)?;
        in_range("tyre sliding_grip", tyre.sliding_grip, 0.0, 1.0)?;
        in_range("tyre sliding_slip", tyre.sliding_slip, 1.0 + 1e-3, 1e3)?;
        in_range("tyre rolling_resistance", tyre.rolling_resistance, 0.0, 1.0).map(|_| ())
    }
}

/// A torsion bar between two wheels: it resists that one is compressed more than the other.
///
/// ```
/// use arbiter3d::AntiRollBar;
/// let front = AntiRollBar { left: 0, right: 1, stiffness: 12_000.0 };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntiRollBar {
    /// Number of one wheel.
    pub left: usize,
    /// Number of the other.
    pub right: usize,
    /// Force on each wheel per difference in compression, N/m (0 to 10⁹). It acts while both wheels touch the ground.
    pub stiffness: Real,
}

/// A vehicle to be built on a body.
///
/// ```
/// use arbiter3d::VehicleDefinition;
/// let car = VehicleDefinition::car(0.8, 1.4, -0.2);
/// assert_eq!(car.wheels.len(), 4);
/// ```
#[derive(Clone, Debug)]
pub struct VehicleDefinition {
    /// Unit vector ahead in the frame of the chassis. Default −z.
    pub forward: Vec3,
    /// Unit vector up in the frame of the chassis, at right angles to it; suspensions point down. Default +y.
    pub up: Vec3,
    /// The wheels.
    pub wheels: Vec<WheelDefinition>,
    /// The anti-roll bars. Default none.
    pub anti_roll_bars: Vec<AntiRollBar>,
    /// Torque of the engine at the wheels at full throttle, N m (0 to 10⁹), shared out by the wheels' `drive_share`.
    /// Default 1500.
    pub drive_torque: Real,
    /// Drag of the air, `½ ρ c A`, in N per (m/s)² (0 to 10⁶); it acts at the centre of mass. Default 0.4.
    pub drag: Real,
    /// What the wheels find; the chassis itself is always left out. Default everything but sensors.
    pub filter: QueryFilter<'static>,
}

impl Default for VehicleDefinition {
    fn default() -> Self {
        Self {
            forward: Vec3::NEG_Z,
            up: Vec3::Y,
            wheels: Vec::new(),
            anti_roll_bars: Vec::new(),
            drive_torque: 1500.0,
            drag: 0.4,
            filter: QueryFilter::default(),
        }
    }
}

impl VehicleDefinition {
    /// A car that looks along −z: front left, front right, rear left, rear right. The front is steered, the rear driven
    /// and held by the handbrake. Wheels are `half_track` to the side, `half_base` ahead or behind, attached at
    /// `height`.
    #[must_use]
    pub fn car(half_track: Real, half_base: Real, height: Real) -> Self {
        let wheel = |x: Real, z: Real| WheelDefinition::at(Vec3::new(x, height, z));
        let front = |x: Real| WheelDefinition { steered: true, ..wheel(x, -half_base) };
        let rear = |x: Real| WheelDefinition { drive_share: 0.5, handbrake_torque: 3000.0, ..wheel(x, half_base) };
        Self {
            wheels: vec![front(-half_track), front(half_track), rear(-half_track), rear(half_track)],
            ..Self::default()
        }
    }

    pub(super) fn validate(&self) -> Result<(), Error> {
        unit_vec("vehicle forward", self.forward)?;
        unit_vec("vehicle up", self.up)?;
        in_range("forward · up", self.forward.dot(self.up), -1e-3, 1e-3)?;
        in_range("drive_torque", self.drive_torque, 0.0, 1e9)?;
        in_range("drag", self.drag, 0.0, 1e6)?;
        let last = self.wheels.len() as Real - 1.0;
        for bar in &self.anti_roll_bars {
            in_range("wheel of an anti-roll bar", bar.left as Real, 0.0, last)?;
            in_range("wheel of an anti-roll bar", bar.right as Real, 0.0, last)?;
            in_range("anti-roll bar stiffness", bar.stiffness, 0.0, 1e9)?;
        }
        self.wheels.iter().try_for_each(WheelDefinition::validate)
    }
}

/// What the driver does.
///
/// ```
/// use arbiter3d::VehicleControls;
/// let full_ahead = VehicleControls { throttle: 1.0, ..VehicleControls::default() };
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VehicleControls {
    /// Share of the drive torque, −1 (backwards) to 1. Default 0.
    pub throttle: Real,
    /// Share of the brake torque, 0 to 1. Default 0.
    pub brake: Real,
    /// Share of the handbrake torque, 0 to 1. Default 0.
    pub handbrake: Real,
    /// Angle of the steered wheels, radians, −1.3 to 1.3; positive to the left. The wheels of an axle are turned each
    /// by its own angle, so that all point along circles about one centre on the line of the wheels that are not
    /// steered (Ackermann). Default 0.
    pub steering: Real,
}

impl VehicleControls {
    pub(super) fn validate(&self) -> Result<(), Error> {
        in_range("throttle", self.throttle, -1.0, 1.0)?;
        in_range("brake", self.brake, 0.0, 1.0)?;
        in_range("handbrake", self.handbrake, 0.0, 1.0)?;
        in_range("steering", self.steering, -1.3, 1.3).map(|_| ())
    }
}
