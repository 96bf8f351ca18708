//! Feeds a replay page from a running world, at most 60 frames a second of simulated time.

use crate::problem::Problem;
use crate::replay::{
    ArbiterSample, BodyInfo, BodyKind, BodySample, BodyState, ContactDetail, ContactSample, Frame, Geometry, Recording,
    RecordingOptions, ShapeInstance,
};
use crate::report::cannot_write;
use arbiter3d::{
    BodyId, Shape, ShapeId, World,
    math::{Quat, Vec3},
};
use arbiter3d_scenes::BuiltScene;
use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::path::PathBuf;

/// Frames a second of simulated time: more cannot be seen.
const FRAME_RATE: f32 = 60.0;

/// A page in the making.
pub(crate) struct Film {
    path: PathBuf,
    recording: Recording,
    /// Steps from one frame to the next.
    stride: usize,
    /// Index in the recording of each body ever seen.
    indices: BTreeMap<BodyId, u32>,
    samples: Vec<BodySample>,
    arbiters: Vec<ArbiterSample>,
    contacts: Vec<ContactSample>,
}

impl Film {
    /// Opens the page's file and records the world before its first step.
    pub fn begin(path: PathBuf, title: &str, scene: &BuiltScene) -> Result<Self, Problem> {
        // Opened to append, so that an older page survives a run that fails.
        OpenOptions::new().create(true).append(true).open(&path).map_err(|error| cannot_write(&path, error))?;
        let stride = ((scene.hz / FRAME_RATE) * 0.999).ceil().max(1.0) as usize;
        let frame_seconds = stride as f64 / f64::from(scene.hz);
        let mut film = Self {
            path,
            recording: Recording::new(RecordingOptions::new(title, frame_seconds)),
            stride,
            indices: BTreeMap::new(),
            samples: Vec::new(),
            arbiters: Vec::new(),
            contacts: Vec::new(),
        };
        film.push(&scene.world, 0)?;
        Ok(film)
    }

    /// Records the world after `step` steps, if this is a step to record.
    pub fn push(&mut self, world: &World, step: usize) -> Result<(), Problem> {
        if !step.is_multiple_of(self.stride) {
            return Ok(());
        }
        self.sample_bodies(world)?;
        let wants_detail = self.recording.wants_detail();
        if wants_detail {
            self.sample_contacts(world);
        }
        let detail = ContactDetail { arbiters: &self.arbiters, contacts: &self.contacts };
        self.recording.push_frame(&Frame {
            step: step as u64,
            bodies: &self.samples,
            arbiter_count: world.arbiter_count(),
            contact_count: world.contact_count(),
            detail: wants_detail.then_some(detail),
        })?;
        Ok(())
    }

    /// Writes the page and says where it is.
    pub fn finish(mut self) -> Result<String, Problem> {
        let statistics = self.recording.write_html(&self.path).map_err(|error| cannot_write(&self.path, error))?;
        let size = statistics.bytes as f64 / 1e6;
        let notes: String = statistics.notes.iter().map(|note| format!("\n{:<20}   {note}", "")).collect();
        Ok(format!("{} ({size:.1} MB, {} frames){notes}", self.path.display(), statistics.frames))
    }

    fn sample_bodies(&mut self, world: &World) -> Result<(), Problem> {
        self.samples.iter_mut().for_each(|sample| sample.state = BodyState::Absent);
        let islands = world.islands();
        for id in world.bodies() {
            let Some(body) = world.body(id) else { continue };
            let index = match self.indices.get(&id) {
                Some(&index) => index,
                None => self.add_body(world, id, body.kind(), body.shapes())?,
            };
            let state = match (body.is_enabled(), body.is_awake()) {
                (false, _) => BodyState::Absent,
                (true, false) => BodyState::Asleep,
                (true, true) => BodyState::Awake,
            };
            let island = islands.get(id.index() as usize).copied().unwrap_or(BodySample::NO_ISLAND);
            let (position, rotation) = (body.position().to_array(), body.rotation().to_array());
            self.samples[index as usize] = BodySample { state, island, ..BodySample::at(position, rotation) };
        }
        Ok(())
    }

    fn add_body(
        &mut self,
        world: &World,
        id: BodyId,
        kind: arbiter3d::BodyKind,
        shapes: &[ShapeId],
    ) -> Result<u32, Problem> {
        let kind = match kind {
            arbiter3d::BodyKind::Static => BodyKind::Static,
            arbiter3d::BodyKind::Kinematic => BodyKind::Kinematic,
            arbiter3d::BodyKind::Dynamic => BodyKind::Dynamic,
        };
        let name = (id == BodyId::WORLD).then(|| "world".to_owned());
        let body = self.recording.add_body(BodyInfo { kind, name });
        for shape in shapes.iter().filter_map(|&id| world.shape(id)) {
            let geometry = self.recording.add_geometry(geometry(shape.geometry()))?;
            let (position, rotation) = (shape.position().to_array(), shape.rotation().to_array());
            self.recording.add_shape(ShapeInstance { body, geometry, position, rotation })?;
        }
        self.indices.insert(id, body);
        self.samples.push(BodySample::at(Vec3::ZERO.to_array(), Quat::IDENTITY.to_array()));
        Ok(body)
    }

    fn sample_contacts(&mut self, world: &World) {
        self.arbiters.clear();
        self.contacts.clear();
        for arbiter in world.arbiters() {
            let index = |id: BodyId| self.indices.get(&id).copied();
            let (Some(body1), Some(body2)) = (index(arbiter.body1()), index(arbiter.body2())) else { continue };
            let before = self.contacts.len();
            let points = world.contact_points(arbiter);
            self.contacts.extend(points.zip(arbiter.data().contacts()).map(|((_, point1, point2), (_, contact))| {
                ContactSample {
                    point: ((point1 + point2) * 0.5).to_array(),
                    normal: contact.normal().to_array(),
                    normal_impulse: contact.normal_impulse(),
                }
            }));
            self.arbiters.push(ArbiterSample {
                key: (arbiter.key().key1, arbiter.key().key2),
                bodies: (body1, body2),
                friction: arbiter.data().friction(),
                contact_count: (self.contacts.len() - before) as u8,
            });
        }
    }
}

/// Steps of the surfaces that the page draws for round shapes that it does not know.
const DRAWN_STEPS: usize = 12;

/// What the page draws for a shape.
fn geometry(shape: &Shape) -> Geometry {
    match shape {
        Shape::Sphere(sphere) => Geometry::Sphere { radius: sphere.radius() },
        Shape::Capsule(capsule) => Geometry::Capsule { half_length: capsule.half_length(), radius: capsule.radius() },
        Shape::Cuboid(cuboid) => Geometry::Cuboid { half_extents: cuboid.half_extents().to_array() },
        other => {
            let (vertices, triangles) = other.triangulate(DRAWN_STEPS);
            let vertices = arrays(&vertices);
            if other.is_convex() {
                Geometry::Hull { vertices, triangles }
            } else {
                Geometry::Mesh { vertices, triangles }
            }
        }
    }
}

fn arrays(points: &[Vec3]) -> Vec<[f32; 3]> {
    points.iter().map(|point| point.to_array()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_of_a_hull_is_drawn_with_twelve_triangles_facing_outward() {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) - Vec3::splat(0.5);
        let points: Vec<Vec3> = (0..8).map(corner).collect();
        let Geometry::Hull { vertices, triangles } = geometry(&Shape::hull(&points).unwrap()) else {
            panic!("a hull is drawn as one");
        };
        assert_eq!(triangles.len(), 12);
        assert!((volume(&vertices, &triangles) - 1.0).abs() < 1e-5);
    }

    fn volume(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> f32 {
        let at = |i: u32| Vec3::from(vertices[i as usize]);
        triangles.iter().map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0).sum()
    }

    /// What the page has no drawing of its own for is drawn as a closed surface with nearly the shape's volume.
    #[test]
    fn every_convex_shape_is_drawn_with_its_volume() {
        let cube = Shape::cuboid(Vec3::splat(0.4)).unwrap();
        let shapes = [
            Shape::cylinder(0.5, 0.3).unwrap(),
            Shape::cone(0.5, 0.3).unwrap(),
            Shape::tapered_capsule(0.4, 0.2, 0.3).unwrap(),
            Shape::ellipsoid(Vec3::new(0.2, 0.4, 0.6)).unwrap(),
            Shape::rounded(&cube, 0.1).unwrap(),
        ];
        for shape in shapes {
            let Geometry::Hull { vertices, triangles } = geometry(&shape) else { panic!("{shape:?} is not drawn") };
            let (drawn, true_volume) = (volume(&vertices, &triangles), shape.mass_properties(1.0).unwrap().mass);
            assert!(drawn < true_volume && drawn > 0.96 * true_volume, "{shape:?}: {drawn}, not {true_volume}");
        }
    }

    /// Bodies that appear in the middle of a run are in the page, and frames come at 60 a second at most.
    #[test]
    fn late_bodies_are_recorded_and_frames_are_thinned_to_sixty_a_second() {
        let scene = arbiter3d_scenes::find("large_world").unwrap();
        let options = arbiter3d_scenes::SceneOptions { size: Some(2), hz: Some(240.0), ..Default::default() };
        let mut built = scene.build(&options).unwrap();
        let path = std::env::temp_dir().join(format!("arbiter3d-film-{}.html", std::process::id()));
        let mut film = Film::begin(path.clone(), "late", &built).unwrap();
        for step in 0..24 {
            built.step(step).unwrap();
            film.push(&built.world, step + 1).unwrap();
        }
        assert_eq!((film.recording.frames(), film.stride), (7, 4));
        // The world's own body, four slabs, and the balls of steps 5, 10, 15 and 20.
        assert_eq!(film.samples.len(), 1 + 4 + 4);
        assert!(film.finish().unwrap().contains("7 frames"));
        std::fs::remove_file(path).unwrap();
    }
}
