//! The list of all scenes by name.

use crate::{BuiltScene, SceneOptions, scenes};
use arbiter3d::{Error, math::Real};

/// A scene that can be built by name.
///
/// ```
/// use arbiter3d_scenes::SCENES;
/// for scene in SCENES {
///     println!("{}: {}", scene.name, scene.description);
/// }
/// ```
pub struct Scene {
    /// What to call it.
    pub name: &'static str,
    /// What it shows, in one line.
    pub description: &'static str,
    /// What [`SceneOptions::size`] counts in this scene.
    pub size: Size,
    build: fn(&SceneOptions, usize) -> Result<BuiltScene, Error>,
}

/// What scales a scene.
///
/// ```
/// let scene = arbiter3d_scenes::find("large_pyramid").unwrap();
/// assert_eq!((scene.size.meaning, scene.size.default), ("rows", 100));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// What it counts; empty for a scene of one size.
    pub meaning: &'static str,
    /// The published one.
    pub default: usize,
    /// The largest, some millions of bodies.
    pub limit: usize,
}

impl Size {
    /// A scene that comes in one size.
    const FIXED: Self = Self::new("", 1, 1);

    const fn new(meaning: &'static str, default: usize, limit: usize) -> Self {
        Self { meaning, default, limit }
    }
}

impl Scene {
    /// Builds the scene.
    ///
    /// # Errors
    /// If an option is out of its range or the machine lacks the SIMD level.
    pub fn build(&self, options: &SceneOptions) -> Result<BuiltScene, Error> {
        let size = options.size.unwrap_or(self.size.default);
        if !(1..=self.size.limit).contains(&size) {
            let high = self.size.limit as Real;
            return Err(Error::OutOfRange { what: "size", value: size as Real, low: 1.0, high });
        }
        (self.build)(options, size)
    }
}

/// The scene of this name.
#[must_use]
pub fn find(name: &str) -> Option<&'static Scene> {
    SCENES.iter().find(|scene| scene.name == name)
}

/// The names most like a mistyped one, best first, at most three.
#[must_use]
pub fn nearest(name: &str) -> Vec<&'static str> {
    let wanted = name.to_lowercase();
    let mut ranked: Vec<(usize, &'static str)> = SCENES
        .iter()
        .map(|scene| {
            let contained = wanted.len() > 2 && (scene.name.contains(&wanted) || wanted.contains(scene.name));
            (if contained { 1 } else { edit_distance(&wanted, scene.name) }, scene.name)
        })
        .collect();
    ranked.sort_unstable();
    let limit = 1 + wanted.len() / 3;
    ranked.into_iter().filter(|&(distance, _)| distance <= limit).take(3).map(|(_, name)| name).collect()
}

/// Levenshtein's distance: how many letters must be added, removed or changed.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &to) in b.iter().enumerate() {
            let changed = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// Every scene, in the order in which they are listed.
pub static SCENES: &[Scene] = &[
    Scene {
        name: "colosseum_break",
        description: "8,817 stones in six rings stand for 2 s, then a ball of 200 t hits them at 40 m/s",
        size: Size::new("layers", 6, 40),
        build: scenes::colosseum::colosseum_break,
    },
    Scene {
        name: "colosseum",
        description: "8,817 stones in six rings, standing (Jitter2's largest stack)",
        size: Size::new("layers", 6, 40),
        build: scenes::colosseum::colosseum,
    },
    Scene {
        name: "large_pyramid",
        description: "5,050 cubes in one upright triangle of 100 rows (Box3D)",
        size: Size::new("rows", 100, 1000),
        build: scenes::stacks::large_pyramid,
    },
    Scene {
        name: "many_pyramids",
        description: "14 × 14 small pyramids, 10,780 cubes (Box3D)",
        size: Size::new("pyramids along a side", 14, 100),
        build: scenes::stacks::many_pyramids,
    },
    Scene {
        name: "pyramid20",
        description: "an upright triangle of 20 rows with small gaps, 210 cubes (Jitter2)",
        size: Size::new("rows", 20, 1000),
        build: scenes::stacks::gapped_pyramid,
    },
    Scene {
        name: "jolt_pyramid",
        description: "1,240 boxes dropped into a four-sided pyramid of 15 layers (Jolt)",
        size: Size::new("layers", 15, 100),
        build: scenes::stacks::jolt_pyramid,
    },
    Scene {
        name: "wide_pyramid",
        description: "1,240 slightly smaller boxes dropped into a four-sided pyramid of 15 layers (Box3D)",
        size: Size::new("layers", 15, 100),
        build: scenes::stacks::wide_pyramid,
    },
    Scene {
        name: "tower",
        description: "a round tower of 40 rings of 32 planks (Jitter2)",
        size: Size::new("rings", 40, 10_000),
        build: scenes::stacks::tower,
    },
    Scene {
        name: "convex_pile",
        description: "5,120 rocks of 32 points fall into a heap (Box3D)",
        size: Size::new("layers of 64 rocks", 80, 10_000),
        build: scenes::piles::convex_pile,
    },
    Scene {
        name: "junkyard",
        description: "10,584 rocks fall into a yard where a pillar ploughs through them (Box3D)",
        size: Size::new("layers of 441 rocks", 24, 2000),
        build: scenes::piles::junkyard,
    },
    Scene {
        name: "convex_vs_mesh",
        description: "1,764 mixed bodies bounce on hills of 20,000 triangles (Jolt)",
        size: Size::new("layers of 441 bodies", 4, 2000),
        build: scenes::piles::convex_vs_mesh,
    },
    Scene {
        name: "shape_parade",
        description: "every convex kind of shape rains on a wavy mesh",
        size: Size::new("bodies", 192, 100_000),
        build: scenes::parade::shape_parade,
    },
    Scene {
        name: "mesh_rain",
        description: "2,048 mixed bodies rain on a wavy mesh",
        size: Size::new("bodies", 2048, 1_000_000),
        build: scenes::piles::mesh_rain,
    },
    Scene {
        name: "compound_rain",
        description: "512 compounds of three to six parts rain into a pit of voxels and of a compound",
        size: Size::new("bodies", 512, 1_000_000),
        build: scenes::piles::compound_rain,
    },
    Scene {
        name: "mesh_rain10k",
        description: "10,000 mixed bodies rain on a wavy mesh",
        size: Size::new("bodies", 10_000, 1_000_000),
        build: scenes::piles::mesh_rain,
    },
    Scene {
        name: "spheres10k",
        description: "10,000 balls pour into a walled pit",
        size: Size::new("balls", 10_000, 1_000_000),
        build: scenes::piles::spheres,
    },
    Scene {
        name: "cans",
        description: "1,000 cans fall into a pit, where they stay awake",
        size: Size::new("cans", 1000, 1_000_000),
        build: scenes::piles::cans,
    },
    Scene {
        name: "ellipsoids",
        description: "1,000 ellipsoids fall into a pit, where they stay awake",
        size: Size::new("ellipsoids", 1000, 1_000_000),
        build: scenes::piles::ellipsoids,
    },
    Scene {
        name: "boxes_rain",
        description: "a small start: 400 boxes, balls, capsules and rocks fall into a tray",
        size: Size::new("bodies", 400, 1_000_000),
        build: scenes::piles::boxes_rain,
    },
    Scene {
        name: "washer",
        description: "8,000 small cubes in a turning drum with paddles (Box3D)",
        size: Size::new("cubes along an edge", 20, 100),
        build: scenes::drums::washer,
    },
    Scene {
        name: "rotating_cube",
        description: "8,000 boxes tumble in a turning hollow cube (Jitter2)",
        size: Size::new("boxes along an edge", 20, 100),
        build: scenes::drums::rotating_cube,
    },
    Scene {
        name: "large_world",
        description: "balls drop on a plain of 1,000,000 static bodies (Box3D)",
        size: Size::new("static bodies along a side", 1000, 2000),
        build: scenes::fields::large_world,
    },
    Scene {
        name: "sleeping_field",
        description: "100,000 bodies asleep and 100 balls that never rest: what sleep costs",
        size: Size::new("sleeping bodies", 100_000, 2_000_000),
        build: scenes::fields::sleeping_field,
    },
    Scene {
        name: "sleeping_all",
        description: "100,000 bodies asleep and none awake: what an idle world costs",
        size: Size::new("sleeping bodies", 100_000, 2_000_000),
        build: scenes::fields::sleeping_all,
    },
    Scene {
        name: "trees100",
        description: "50 falling trees of 22 hulls each on a wave of 60,000 triangles (Box3D)",
        size: Size::new("trees", 50, 1000),
        build: scenes::trees::trees100,
    },
    Scene {
        name: "trees50",
        description: "the same on 240,000 triangles of half the width (Box3D)",
        size: Size::new("trees", 50, 1000),
        build: scenes::trees::trees50,
    },
    Scene {
        name: "trees25",
        description: "the same on 960,000 triangles of a quarter of the width (Box3D)",
        size: Size::new("trees", 50, 1000),
        build: scenes::trees::trees25,
    },
    Scene {
        name: "high_speed_room",
        description: "5,000 bodies at 250 m/s in a closed room with elastic walls (Jolt)",
        size: Size::new("bodies", 5000, 100_000),
        build: scenes::fast::high_speed_room,
    },
    Scene {
        name: "high_speed_bullets",
        description: "the same with bullets, which hit each other too and lose no time",
        size: Size::new("bodies", 5000, 100_000),
        build: scenes::fast::high_speed_bullets,
    },
    Scene {
        name: "spinning_rods",
        description: "400 thin rods spin at 100 rad/s in a closed room with walls of 1 cm",
        size: Size::new("rods", 400, 100_000),
        build: scenes::fast::spinning_rods,
    },
    Scene {
        name: "high_speed_kinds",
        description: "hammers, rings, voxels and needles at 100 m/s in a room with walls of 1 cm, and a fast paddle",
        size: Size::new("bodies", 200, 10_000),
        build: scenes::fast::high_speed_kinds,
    },
    Scene {
        name: "ramps",
        description: "boxes with friction 0, 0.1, … 1 on a slope of 30°: those above 0.577 stick",
        size: Size::FIXED,
        build: scenes::behaviour::ramps,
    },
    Scene {
        name: "box_floor_slide",
        description: "16 bodies slide without friction over a floor of 1,024 separate boxes",
        size: Size::FIXED,
        build: scenes::behaviour::box_floor_slide,
    },
    Scene {
        name: "bounce",
        description: "balls with restitution 0, 0.1, … 1 fall from the same height",
        size: Size::FIXED,
        build: scenes::behaviour::bounce,
    },
    Scene {
        name: "t_handle",
        description: "a T-shaped handle spins weightless and flips over 37 times in 20 s",
        size: Size::FIXED,
        build: scenes::behaviour::t_handle,
    },
    Scene {
        name: "vehicle_track",
        description: "a car drives rounds on a track with humps and pushes crates out of its way",
        size: Size::FIXED,
        build: scenes::vehicles::vehicle_track,
    },
    Scene {
        name: "buoyancy_pool",
        description: "balls, boxes, capsules and rocks of 200 to 1,700 kg/m³ fall into a pool: the light ones float",
        size: Size::new("bodies", 64, 100_000),
        build: scenes::fluids::buoyancy_pool,
    },
    Scene {
        name: "character_course",
        description: "a character takes stairs, slopes, gaps, a lift, a turning disc, a low ceiling, a crate and a wedge",
        size: Size::FIXED,
        build: scenes::character::character_course,
    },
    Scene {
        name: "gears",
        description: "two gears, meshes of 12 and 24 teeth: the small one drives the large one",
        size: Size::FIXED,
        build: scenes::gears_and_tiles::gears,
    },
    Scene {
        name: "height_field_tiles",
        description: "200 mixed bodies fall on 3 × 3 height fields side by side",
        size: Size::new("bodies", 200, 100_000),
        build: scenes::gears_and_tiles::height_field_tiles,
    },
    Scene {
        name: "one_way_platforms",
        description: "ten bodies are thrown up through one-way platforms and stand each on its floor; a lift passes and carries",
        size: Size::new("columns", 10, 100_000),
        build: scenes::surfaces::one_way_platforms,
    },
    Scene {
        name: "conveyors",
        description: "eight boxes go round on a ring of belts, and seven skids slide along themselves on a slope",
        size: Size::FIXED,
        build: scenes::surfaces::conveyors,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_can_be_typed() {
        for (i, scene) in SCENES.iter().enumerate() {
            assert!(SCENES[..i].iter().all(|other| other.name != scene.name), "{} is listed twice", scene.name);
            assert!(scene.name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_'));
            assert!(!scene.description.is_empty() && !scene.description.contains('\n'));
        }
    }

    #[test]
    fn sizes_out_of_range_are_refused() {
        let size = |name: &str, size: usize| {
            find(name).unwrap().build(&SceneOptions { size: Some(size), ..Default::default() })
        };
        assert!(matches!(size("large_pyramid", 1001), Err(Error::OutOfRange { what: "size", .. })));
        assert!(size("large_pyramid", 0).is_err() && size("bounce", 2).is_err());
        assert!(size("large_pyramid", 2).is_ok() && size("bounce", 1).is_ok());
    }

    #[test]
    fn a_mistyped_name_finds_the_one_meant() {
        assert_eq!(nearest("collosseum")[0], "colosseum");
        assert_eq!(nearest("large-pyramid")[0], "large_pyramid");
        assert!(nearest("pyramid").contains(&"large_pyramid"));
        assert!(nearest("xyzzy_plugh").is_empty());
    }

    #[test]
    fn edit_distance_counts_letters() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
    }
}
