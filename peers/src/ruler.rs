//! What a run has come to, measured alike for every engine.
//!
//! The bodies are put where the engine left them into a fresh arbiter3d world without gravity, whose narrow phase finds all
//! contacts anew in one step of a microsecond with contact springs switched off, so that nothing moves. Depths and contact
//! points are then those of one and the same code.

use crate::engine::State;
use crate::scene::{Body, Scene};
use arbiter3d::math::{Pose, Real, Rotation, Vec3};
use arbiter3d::{BodyDefinition, BodyId, BodyKind, Error, World, WorldSettings};

/// The state of all bodies of a run, by index.
pub type States = Vec<Option<State>>;

/// Figures that show whether the work was done, and how well.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Mean height of the dynamic bodies' origins, metres.
    pub mean_height: f64,
    /// Largest overlap of any contact, metres: the median over some moments of the last steps.
    pub deepest_penetration: f64,
    /// Points nearer than the speculative distance, by our narrow phase.
    pub points: usize,
    /// Dynamic bodies that are awake.
    pub awake: usize,
    /// Farthest that a dynamic body of the start has moved sideways, metres.
    pub drift: f64,
    /// Farthest that one has moved along z: out of its plane, in the pyramids.
    pub drift_z: f64,
    /// Farthest that a body which started asleep has moved, metres.
    pub sleeper_drift: f64,
    /// Energy of motion, J.
    pub kinetic_energy: f64,
    /// Bodies below all ground, far outside, or not finite.
    pub lost: usize,
    /// Bodies whose numbers are not finite.
    pub not_finite: usize,
}

/// Measures where an engine has left the bodies of a scene; of the depth, the median over that moment and some `earlier` ones.
pub fn measure(scene: &Scene, states: &States, earlier: &[States]) -> Result<Quality, Error> {
    let mut quality = measure_moment(scene, states)?;
    let mut depths = vec![quality.deepest_penetration];
    for states in earlier {
        depths.push(measure_moment(scene, states)?.deepest_penetration);
    }
    depths.sort_unstable_by(f64::total_cmp);
    quality.deepest_penetration = depths[depths.len() / 2];
    Ok(quality)
}

fn measure_moment(scene: &Scene, states: &States) -> Result<Quality, Error> {
    let bodies: Vec<(&Body, Option<State>)> = scene.all_bodies().zip(states.iter().copied()).collect();
    let mut quality = Quality { mean_height: mean_height(&bodies), ..Quality::default() };
    let bounds = Bounds::of(scene);
    for (_, state) in dynamic(&bodies) {
        if !is_finite(&state) {
            quality.not_finite += 1;
            quality.lost += 1;
            continue;
        }
        quality.awake += usize::from(state.awake);
        quality.lost += usize::from(!bounds.contains(state.position));
    }
    let started = &bodies[..scene.bodies.len().min(bodies.len())];
    for (body, state) in dynamic(started).filter(|(_, state)| is_finite(state)) {
        let moved = state.position - body.definition.position;
        quality.drift = quality.drift.max(f64::from(moved.x.hypot(moved.z)));
        quality.drift_z = quality.drift_z.max(f64::from(moved.z.abs()));
        if !body.definition.awake {
            quality.sleeper_drift = quality.sleeper_drift.max(f64::from(moved.length()));
        }
    }
    touch(scene, &bodies, &mut quality)?;
    Ok(quality)
}

/// The mean height that bodies have at the start.
pub fn start_height(scene: &Scene) -> f64 {
    let heights = scene.bodies.iter().filter(|body| body.definition.kind == BodyKind::Dynamic);
    mean(heights.map(|body| f64::from(body.definition.position.y)))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    if count == 0 { 0.0 } else { sum / count as f64 }
}

fn mean_height(bodies: &[(&Body, Option<State>)]) -> f64 {
    mean(dynamic(bodies).map(|(_, state)| f64::from(state.position.y)))
}

fn dynamic<'a>(bodies: &'a [(&'a Body, Option<State>)]) -> impl Iterator<Item = (&'a Body, State)> {
    let kind = |body: &Body| body.definition.kind == BodyKind::Dynamic;
    bodies.iter().filter_map(move |&(body, state)| state.filter(|_| kind(body)).map(|state| (body, state)))
}

fn is_finite(state: &State) -> bool {
    let vectors = [state.position, state.linear_velocity, state.angular_velocity];
    vectors.iter().all(|v| v.is_finite()) && state.rotation.is_finite() && state.rotation.length() > 0.1
}

/// Where bodies may be: above the lowest ground, and not farther to a side than what there is at the start.
struct Bounds {
    floor: Real,
    low: Vec3,
    high: Vec3,
}

/// How far below the ground a body's origin may be, metres: some origins are near the surface of their body.
const SUNK: Real = 1.0;

impl Bounds {
    fn of(scene: &Scene) -> Self {
        let (mut floor, mut low, mut high) = (Real::MAX, Vec3::splat(Real::MAX), Vec3::splat(Real::MIN));
        for body in scene.all_bodies() {
            let definition = &body.definition;
            let pose = Pose::new(definition.position, Rotation::from_quat(definition.rotation));
            for shape in &body.shapes {
                let local = Pose::new(shape.position, Rotation::from_quat(shape.rotation));
                let aabb = shape.shape.aabb(&pose.mul(&local));
                (low, high) = (low.min(aabb.min), high.max(aabb.max));
                if definition.kind == BodyKind::Static {
                    // What lies on a solid is above its top, what lies on a mesh above its lowest valley.
                    floor = floor.min(if shape.shape.is_convex() { aabb.max.y } else { aabb.min.y });
                }
            }
        }
        let size = (high - low).max_element();
        let margin = Vec3::splat(size.min(100.0));
        // Without ground, in a container that turns, what has leaked out soon falls far.
        let floor = if floor == Real::MAX { low.y - 0.5 * size } else { floor - SUNK };
        Self { floor, low: low - margin, high: high + margin }
    }

    fn contains(&self, p: Vec3) -> bool {
        p.y >= self.floor && p.x >= self.low.x && p.z >= self.low.z && p.x <= self.high.x && p.z <= self.high.z
    }
}

/// Puts the bodies into a world of ours and has its narrow phase look at them.
fn touch(scene: &Scene, bodies: &[(&Body, Option<State>)], quality: &mut Quality) -> Result<(), Error> {
    let settings = WorldSettings {
        gravity: Vec3::ZERO,
        contact_hertz: 0.0,
        slop: 0.0,
        substeps: 1,
        allow_sleep: false,
        continuous: false,
        threads: 1,
        ..scene.settings
    };
    let mut world = World::new(settings)?;
    let mut moving = Vec::new();
    for &(body, state) in bodies {
        let Some(state) = state.filter(is_finite) else { continue };
        let id = if body.is_world {
            BodyId::WORLD
        } else {
            world.add_body(&BodyDefinition {
                position: state.position,
                rotation: state.rotation.normalize(),
                linear_velocity: Vec3::ZERO,
                angular_velocity: Vec3::ZERO,
                awake: true,
                ..body.definition.clone()
            })?
        };
        for shape in &body.shapes {
            world.add_shape(id, shape)?;
        }
        if body.definition.kind == BodyKind::Dynamic {
            moving.push((id, state));
        }
    }
    world.step(1e-6)?;
    quality.deepest_penetration = f64::from(world.deepest_penetration());
    quality.points = world.contact_count();
    for (id, state) in moving {
        if let Some(mut body) = world.body_mut(id) {
            body.set_linear_velocity(state.linear_velocity)?;
            body.set_angular_velocity(state.angular_velocity)?;
        }
    }
    quality.kinetic_energy = world.kinetic_energy();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use arbiter3d_scenes::{SceneOptions, find};

    fn scene(name: &str, size: usize) -> (Scene, States) {
        let options = SceneOptions { size: Some(size), ..SceneOptions::default() };
        let scene = Scene::read(find(name).unwrap().build(&options).unwrap(), 10).unwrap();
        let state = |body: &Body| State {
            position: body.definition.position,
            rotation: body.definition.rotation,
            linear_velocity: body.definition.linear_velocity,
            angular_velocity: body.definition.angular_velocity,
            awake: body.definition.awake,
        };
        let states = scene.bodies.iter().map(|body| Some(state(body))).collect();
        (scene, states)
    }

    /// Three cubes of 1 m on the ground, in two rows; the upper one is pressed in by 5 cm and flies at 2 m/s.
    #[test]
    fn depth_height_drift_and_energy_are_those_of_the_poses() {
        let (scene, mut states) = scene("large_pyramid", 2);
        let untouched = measure(&scene, &states, &[]).unwrap();
        assert!(untouched.deepest_penetration < 1e-4, "{untouched:?}");
        assert_eq!((untouched.awake, untouched.lost), (3, 0));
        let top = states.last_mut().unwrap().as_mut().unwrap();
        top.position += Vec3::new(0.0, -0.05, 0.03);
        top.linear_velocity = Vec3::X * 2.0;
        let quality = measure(&scene, &states, &[]).unwrap();
        assert!((quality.deepest_penetration - 0.05).abs() < 1e-4, "{quality:?}");
        assert!((quality.mean_height - (0.5 + 0.5 + 1.45) / 3.0).abs() < 1e-6, "{quality:?}");
        assert!((quality.drift - 0.03).abs() < 1e-6 && (quality.drift_z - 0.03).abs() < 1e-6, "{quality:?}");
        // 100 kg at 2 m/s.
        assert!((quality.kinetic_energy - 200.0).abs() < 1e-3, "{quality:?}");
        assert!(quality.points >= 12, "{quality:?}");
    }

    #[test]
    fn what_falls_through_or_is_not_finite_is_lost() {
        let (scene, mut states) = scene("large_pyramid", 3);
        states[1].as_mut().unwrap().position.y = -3.0;
        states[2].as_mut().unwrap().position.x = Real::NAN;
        states[3].as_mut().unwrap().position.z = 5000.0;
        let quality = measure(&scene, &states, &[]).unwrap();
        assert_eq!((quality.lost, quality.not_finite), (3, 1), "{quality:?}");
    }
}
