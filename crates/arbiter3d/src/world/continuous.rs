//! Continuous collision: fast dynamic bodies are stopped at static shapes that they would pass through.
//!
//! A body is fast when some point of it has moved farther in the step than half its inner radius. Its shapes are swept from
//! where they were to where they are against the static tree; at the first impact the body stays where it came within a slop of
//! touching, with its velocity. Contact is then found in the next step, which turns the velocity away. The rest of the step's
//! motion is lost.
//!
//! Every shape has a core, which is thinner by half its inner radius. Only a shape whose core would hit is stopped: what
//! merely slides or rolls on a floor comes near ever new triangles of it, and must not be held. A shape that comes from
//! afar is stopped where its surface hits; one that starts the step within the speculative distance has a contact
//! already, which lets it go along the surface or away, and is stopped where its core hits. So only what the core comes
//! near is looked at: of a mesh those triangles whose box meets the core's way and whose plane the core reaches. That
//! leaves nothing for a log that rolls over ten thousand triangles.
//!
//! Source: conservative advancement, Mirtich, "Impulse-based Dynamic Simulation", 1996.

use super::World;
use super::bodies::Body;
use super::definition::BodyKind;
use super::settings::WorldSettings;
use super::shapes::ShapeSlot;
use crate::broad_phase::BroadPhase;
use crate::math::{Aabb, Pose, Real, Vec3, max, min};
use crate::narrow_phase::{Support, Sweep, gap, time_of_impact};
use crate::parallel::SharedSlice;
use crate::shape::{Capsule, Cuboid, MeshSides, Shape, Sphere, TriangleMesh};
use crate::solver::SolverBodies;

impl World {
    /// Stops fast bodies at the first static shapes on their ways.
    pub(crate) fn stop_at_impacts(&mut self, fast: &[u32]) {
        if fast.is_empty() {
            return;
        }
        let mut stops = std::mem::take(&mut self.stops);
        stops.clear();
        crate::storage::reserve(&mut stops, fast.len());
        stops.resize(fast.len(), None);
        let places = SharedSlice::new(&mut stops);
        let search = ImpactSearch {
            shapes: &self.shapes,
            bodies: &self.bodies,
            solver: &self.solver_bodies,
            broad_phase: &self.broad_phase,
            settings: &self.scaled,
        };
        self.pool.run_ranges(fast.len(), 1, |range| {
            for at in range {
                // SAFETY: each place belongs to one run.
                unsafe { *places.get_mut(at) = search.stop_of(fast[at]) };
            }
        });
        for (&index, stop) in fast.iter().zip(&stops) {
            if let Some(at) = stop {
                self.stop_at(index, at);
            }
        }
        self.stops = stops;
    }

    /// Puts a body, given the frame of its centre of mass, where it was stopped.
    fn stop_at(&mut self, index: u32, at: &Pose) {
        let mass = &mut self.solver_bodies.masses[index as usize];
        (mass.center, mass.rotation) = (at.position, at.rotation);
        let body = &mut self.bodies[index as usize];
        body.pose = at.mul(&Pose::from_position(body.mass.center).inverse());
        let slots = std::mem::take(&mut body.shape_slots);
        for &slot in &slots {
            let near = self.tight_aabb(slot).expand(self.scaled.speculative_distance);
            if self.broad_phase.update(slot, &near, &near.expand(self.scaled.speculative_distance)) {
                self.note_moved(slot);
            }
        }
        self.bodies[index as usize].shape_slots = slots;
    }
}

/// What a search for impacts reads.
struct ImpactSearch<'a> {
    shapes: &'a [ShapeSlot],
    bodies: &'a [Body],
    solver: &'a SolverBodies,
    broad_phase: &'a BroadPhase,
    settings: &'a WorldSettings,
}

impl ImpactSearch<'_> {
    /// Where the centre frame of a body is to be stopped, if it is.
    fn stop_of(&self, index: u32) -> Option<Pose> {
        let body = &self.bodies[index as usize];
        let state = &self.solver.states[index as usize];
        let end = self.solver.masses[index as usize].pose();
        // The start of the step, at the centre of mass: the rotation by the step's rotation vector undone.
        let start = Pose::new(end.position - state.translation, end.rotation.integrate(-state.turn));
        let way = Way { start, end, turn: state.turn.length() };
        let mut first: Real = 1.0;
        for &slot in &body.shape_slots {
            let shape = &self.shapes[slot as usize];
            if !shape.sensor
                && way.is_fast(shape)
                && let Some(mover) = Mover::new(shape, &way)
            {
                first = min(self.first_impact(&mover, first), first);
            }
        }
        (first < 1.0).then(|| start.interpolate(&end, first))
    }

    /// Fraction of the path at which a shape first comes within a slop of a static one; `limit` if it does not.
    ///
    /// Nothing stops a shape but what its core would hit, so that alone is looked for.
    fn first_impact(&self, mover: &Mover<'_>, limit: Real) -> Real {
        let mut first = limit;
        let near = 2.0 * self.settings.slop;
        self.broad_phase.query_static(&mover.core_box(near), |slot| {
            let other = &self.shapes[slot as usize];
            let body = &self.bodies[other.body as usize];
            if body.kind == BodyKind::Static && !other.sensor && mover.shape.filter.accepts(&other.filter) {
                let pose = body.pose.mul(&other.pose);
                let mover = mover.relative_to(&pose);
                first = min(self.impact_with(&other.geometry, &mover, near).unwrap_or(limit), first);
            }
        });
        first
    }

    /// First impact with a shape at the origin.
    fn impact_with(&self, fixed: &Shape, mover: &Mover<'_>, near: Real) -> Option<Real> {
        let mut first = None;
        let mut note = |impact: Option<Real>| {
            if let Some(t) = impact
                && first.is_none_or(|earliest| t < earliest)
            {
                first = Some(t);
            }
        };
        match fixed {
            Shape::Mesh(mesh) => return self.mesh_impact(mesh, mover, near),
            Shape::Compound(compound) => compound.for_each_child(&mover.core_box(near), |_, child, pose| {
                note(self.impact_with(child, &mover.relative_to(pose), near));
            }),
            Shape::Voxels(grid) => grid.for_each_box(&mover.core_box(near), |_, cuboid, center| {
                let mover = mover.relative_to(&Pose::from_position(center));
                note(self.impact(&Support::Cuboid(cuboid), &mover));
            }),
            convex => return Support::new(convex).and_then(|fixed| self.impact(&fixed, mover)),
        }
        first
    }

    /// First impact with a triangle of a mesh, coming from its solid side; all in the mesh's frame.
    fn mesh_impact(&self, mesh: &TriangleMesh, mover: &Mover<'_>, near: Real) -> Option<Real> {
        let mut first = None;
        let bulge = mover.bulge();
        mesh.for_each_facet(&mover.core_box(near), |index| {
            let facet = mesh.facet(index);
            let (corners, normal) = (facet.corners(), facet.normal());
            let heights = mover.heights(normal, corners[0]);
            let (in_front, comes) = (heights[0] >= 0.0, heights[1] < heights[0]);
            if mesh.sides() == MeshSides::One && !(in_front && comes) {
                return;
            }
            let side = if in_front { 1.0 } else { -1.0 };
            let lowest = mover.lowest_over(normal * side, heights.map(|height| height * side)) - bulge;
            if lowest <= near
                && let Some(t) = self.impact(&Support::Triangle(corners), mover)
                && first.is_none_or(|earliest| t < earliest)
            {
                first = Some(t);
            }
        });
        first
    }

    /// First impact with a convex shape at the origin.
    fn impact(&self, fixed: &Support<'_>, mover: &Mover<'_>) -> Option<Real> {
        let (still, slop) = (Sweep::still(Pose::IDENTITY), self.settings.slop);
        // A violent step before can have pushed the core in: then its very middle stays on this side.
        let pushed_in = gap(fixed, &mover.core, &mover.core_path.start) <= 0.0;
        let middle = mover.middle();
        let inside = if pushed_in { &middle } else { &mover.core };
        let core = time_of_impact(fixed, &still, inside, &mover.core_path, slop)?;
        if pushed_in && gap(fixed, inside, &mover.core_path.start) <= inside.radius() {
            return Some(0.0); // no nearer: half the gap in each step is nothing in the end
        }
        if gap(fixed, &mover.support, &mover.path.start) <= self.settings.speculative_distance {
            return Some(core);
        }
        let surface = time_of_impact(fixed, &still, &mover.support, &mover.path, slop);
        Some(surface.map_or(core, |surface| min(surface, core)))
    }
}

/// The way of a body's centre frame through a step.
struct Way {
    start: Pose,
    end: Pose,
    /// By how much it has turned, radians.
    turn: Real,
}

impl Way {
    /// Whether some point of a shape's core has moved so far that its surface may have been passed. Of a body of many shapes
    /// (a tree that falls) most have not.
    fn is_fast(&self, shape: &ShapeSlot) -> bool {
        let thickness = 0.5 * shape.geometry.inner_radius();
        // How far the core reaches out from its middle, beyond a ball of its thickness.
        let (middle, length) = match &shape.geometry {
            Shape::Sphere(_) => (Vec3::ZERO, 0.0),
            Shape::Capsule(s) => (Vec3::ZERO, s.half_length()),
            Shape::Cuboid(s) => (Vec3::ZERO, (s.half_extents() - Vec3::splat(thickness)).length() - thickness),
            Shape::Hull(hull) => (hull.centroid(), 0.0),
            other => (other.inner_ball().0, 0.0),
        };
        let middle = shape.from_center.transform_point(middle);
        let moved = (self.end.transform_point(middle) - self.start.transform_point(middle)).length();
        moved + self.turn * length > thickness
    }
}

/// A shape on its way through a step.
struct Mover<'a> {
    shape: &'a ShapeSlot,
    support: Support<'a>,
    path: Sweep,
    /// By how much the core is thinner than the shape.
    thickness: Real,
    /// The shape made thinner by half its inner radius; of a hull, a ball in its middle.
    core: Support<'a>,
    core_path: Sweep,
}

impl<'a> Mover<'a> {
    /// `None` for a mesh.
    fn new(shape: &'a ShapeSlot, way: &Way) -> Option<Self> {
        let thickness = 0.5 * shape.geometry.inner_radius();
        let (core, center) = match &shape.geometry {
            Shape::Sphere(_) => (Support::Sphere(Sphere::new(thickness).ok()?), Vec3::ZERO),
            Shape::Capsule(s) => (Support::Capsule(Capsule::new(s.half_length(), thickness).ok()?), Vec3::ZERO),
            Shape::Cuboid(s) => {
                (Support::Cuboid(Cuboid::new(s.half_extents() - Vec3::splat(thickness)).ok()?), Vec3::ZERO)
            }
            Shape::Hull(hull) => (Support::Sphere(Sphere::new(thickness).ok()?), hull.centroid()),
            other => (Support::Sphere(Sphere::new(thickness).ok()?), other.inner_ball().0),
        };
        // A hull's frame may be far from the hull (a part of a tree is given about the tree's foot): it turns about its middle.
        let on_body = &shape.from_center;
        let path = Sweep { start: way.start.mul(on_body), end: way.end.mul(on_body), pivot: center };
        let to_middle = Pose::from_position(center);
        let core_path = Sweep { start: path.start.mul(&to_middle), end: path.end.mul(&to_middle), pivot: Vec3::ZERO };
        let support = match &shape.geometry {
            // Of what is made of parts, the ball in the thickest of them.
            Shape::Compound(_) | Shape::Voxels(_) => {
                let ball = Sphere::new(2.0 * thickness).ok()?;
                return Some(Self {
                    shape,
                    support: Support::Sphere(ball),
                    path: core_path,
                    thickness,
                    core,
                    core_path,
                });
            }
            other => Support::new(other)?,
        };
        Some(Self { shape, support, path, thickness, core, core_path })
    }

    /// A small ball in the middle of the core.
    fn middle(&self) -> Support<'a> {
        Sphere::new(0.1 * self.thickness).map_or(self.core, Support::Sphere)
    }

    /// How far a point of the core may bulge out of the chord of its arc. At radius `r` and a turn by `θ` that is
    /// `r (1 − cos θ/2)`, and the dot product of the two rotations is that cosine.
    fn bulge(&self) -> Real {
        let cosine = self.core_path.start.rotation.dot(self.core_path.end.rotation).abs();
        match self.core {
            Support::Sphere(_) => 0.0,
            _ => self.core.reach(Vec3::ZERO) * max(1.0 - cosine, 0.0),
        }
    }

    /// The box around all of the core's way and what is as `near` to it.
    fn core_box(&self, near: Real) -> Aabb {
        let (start, end) = (&self.core_path.start, &self.core_path.end);
        let around = self.core.bounds(start).union(&self.core.bounds(end));
        around.expand(self.bulge() + near + 1e-3 * self.thickness)
    }

    /// Heights of the core's middle over a plane at the start and at the end.
    fn heights(&self, normal: Vec3, on_plane: Vec3) -> [Real; 2] {
        [&self.core_path.start, &self.core_path.end].map(|pose| (pose.position - on_plane).dot(normal))
    }

    /// The least height of the core over a plane at the start and at the end, given those of its middle.
    fn lowest_over(&self, normal: Vec3, [from, to]: [Real; 2]) -> Real {
        let extent = |pose: &Pose| self.core.extent(pose.rotation.inverse_rotate(-normal));
        min(from - extent(&self.core_path.start), to - extent(&self.core_path.end)) - 1e-3 * self.thickness
    }

    /// The same seen from a frame at rest.
    fn relative_to(&self, frame: &Pose) -> Self {
        let seen = |path: &Sweep| Sweep {
            start: frame.relative(&path.start),
            end: frame.relative(&path.end),
            pivot: path.pivot,
        };
        Self { path: seen(&self.path), core_path: seen(&self.core_path), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use crate::math::{Real, Rotation, Vec3};
    use crate::{BodyDefinition, Shape, ShapeDefinition, World};

    /// A slope of 10° as one box and as a mesh of cells of 1 m, without friction.
    fn slopes() -> [Shape; 2] {
        let cells = 100;
        let corner = |i: usize, j: usize| Vec3::new(i as Real - 1.0, 0.0, j as Real - 10.0);
        let vertices = (0..=cells).flat_map(|i| (0..=20).map(move |j| corner(i, j))).collect();
        let mut triangles = Vec::new();
        for a in (0..cells as u32).flat_map(|i| (0..20).map(move |j| i * 21 + j)) {
            triangles.extend([[a, a + 1, a + 21], [a + 1, a + 22, a + 21]]);
        }
        [Shape::cuboid(Vec3::new(200.0, 1.0, 10.0)).unwrap(), Shape::mesh(vertices, triangles).unwrap()]
    }

    /// Two balls on an axle, a box and a hull slide down a slope faster than their own size a step: they are not held by
    /// the surface that they slide on.
    #[test]
    fn fast_bodies_slide_on_without_being_held() {
        let angle: Real = 10.0_f32.to_radians();
        let down = Vec3::new(libm::cosf(angle), -libm::sinf(angle), 0.0);
        let up = Vec3::new(libm::sinf(angle), libm::cosf(angle), 0.0);
        let turn = Rotation::from_xyzw(0.0, 0.0, -libm::sinf(0.5 * angle), libm::cosf(0.5 * angle)).to_quat();
        let ball = ShapeDefinition::new(Shape::sphere(0.3).unwrap()).friction(0.0);
        let cube = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.3)).unwrap()).friction(0.0);
        let bodies = [
            vec![ball.clone().at(Vec3::new(0.0, 0.0, -0.45)), ball.clone().at(Vec3::new(0.0, 0.0, 0.45))],
            vec![ball],
            vec![cube],
        ];
        for (kind, slope) in slopes().into_iter().enumerate() {
            for shapes in &bodies {
                let mut world = World::default();
                let below = if kind == 0 { -up } else { Vec3::ZERO };
                let ground = world.add_body(&BodyDefinition::fixed().at(below).rotated(turn)).unwrap();
                world.add_shape(ground, &ShapeDefinition::new(slope.clone()).friction(0.0)).unwrap();
                let moving = BodyDefinition::dynamic().at(up * 0.3).rotated(turn).moving(down * 40.0, Vec3::ZERO);
                let body = world.add_body(&moving).unwrap();
                for shape in shapes {
                    world.add_shape(body, shape).unwrap();
                }
                for _ in 0..60 {
                    world.step(1.0 / 60.0).unwrap();
                }
                let moved = world.body(body).unwrap().position();
                let expected = 40.0 + 0.5 * 9.81 * libm::sinf(angle);
                assert!((moved.dot(down) - expected).abs() < 0.1, "{kind}: {} m, not {expected} m", moved.dot(down));
                assert!((moved.dot(up) - 0.3).abs() < 0.01, "{kind}: {} m over the slope", moved.dot(up));
            }
        }
    }

    /// Bodies of 5 cm at 200 m/s, straight and at glancing angles, never get through a wall of 1 cm or a mesh.
    #[test]
    fn fast_bodies_do_not_pass_through_thin_walls() {
        let corners = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
        let square = corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec();
        let walls = [
            Shape::cuboid(Vec3::new(9.0, 9.0, 0.005)).unwrap(),
            Shape::mesh(square, vec![[0, 1, 2], [0, 2, 3]]).unwrap(),
        ];
        let rock: Vec<Vec3> =
            (0..8u8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|b| 0.1 * Real::from(b) - 0.05).into()).collect();
        let shapes = [
            Shape::sphere(0.05).unwrap(),
            Shape::cuboid(Vec3::splat(0.05)).unwrap(),
            Shape::capsule(0.2, 0.05).unwrap(),
            Shape::hull(&rock).unwrap(),
        ];
        for (shape, wall, round) in
            shapes.iter().flat_map(|s| walls.iter().flat_map(move |w| (0..40).map(move |r| (s, w, r))))
        {
            let mut world = World::new(crate::WorldSettings { gravity: Vec3::ZERO, ..Default::default() }).unwrap();
            world.add_shape(crate::BodyId::WORLD, &ShapeDefinition::new(wall.clone())).unwrap();
            let lean = 0.1 * (round % 8) as Real;
            let velocity = Vec3::new(lean, 0.3 * lean, -1.0) * 200.0;
            let start = Vec3::new(-2.0 * lean, 0.0, 0.5 + 0.37 * round as Real);
            let definition = BodyDefinition::dynamic().at(start).moving(velocity, Vec3::new(30.0, 20.0, 10.0) * lean);
            let body = world.add_body(&definition).unwrap();
            world.add_shape(body, &ShapeDefinition::new(shape.clone())).unwrap();
            for step in 0..30 {
                world.step(1.0 / 60.0).unwrap();
                let position = world.body(body).unwrap().position();
                let beside = position.x.abs() > 8.5 || position.y.abs() > 8.5;
                assert!(position.z > 0.0 || beside, "{shape:?}, round {round}, step {step}: at {position}");
                if beside {
                    break;
                }
            }
        }
    }

    /// A thin plate given as a hull 40 m away from its frame, and from its body's origin, is stopped at a one-sided floor
    /// however its frame lies to the floor; below or above it.
    #[test]
    fn a_part_far_from_its_frame_is_stopped_on_the_side_where_it_is() {
        let corners = [(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)];
        let square = corners.map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec();
        let floor = Shape::mesh(square, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        for offset in [Vec3::new(3.0, 40.0, -2.0), Vec3::new(-3.0, -40.0, 2.0), Vec3::new(40.0, 0.0, 0.0)] {
            let plate: Vec<Vec3> = (0..8u8)
                .map(|i| Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|b| Real::from(b) - 0.5)))
                .map(|p| p * Vec3::new(0.8, 0.1, 0.8) + offset)
                .collect();
            let mut world = World::new(crate::WorldSettings { gravity: Vec3::ZERO, ..Default::default() }).unwrap();
            world.add_shape(crate::BodyId::WORLD, &ShapeDefinition::new(floor.clone())).unwrap();
            let falling = BodyDefinition::dynamic().at(Vec3::Y * 1.5 - offset).moving(Vec3::Y * -150.0, Vec3::ZERO);
            let body = world.add_body(&falling).unwrap();
            world.add_shape(body, &ShapeDefinition::new(Shape::hull(&plate).unwrap())).unwrap();
            for _ in 0..10 {
                world.step(1.0 / 60.0).unwrap();
                let height = world.body(body).unwrap().center_of_mass().y;
                assert!(height > 0.02, "frame at {offset}: the plate is at {height}");
            }
        }
    }
}
