//! The shipped scene with a mesh: what rains into the courtyard stays in it.

use arbiter3d::BodyKind;
use std::path::Path;

/// After ten seconds no body has fallen through the floor (whose dish is 1.3 m deep), none is outside the walls, and what
/// still moves rolls slowly.
#[test]
fn nothing_leaves_the_courtyard() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/courtyard.json");
    let mut scene = arbiter3d_cli::load_scene(&path, &Default::default()).unwrap();
    for step in 0..600 {
        assert!(scene.step(step).unwrap().frozen.is_empty());
    }
    let world = &scene.world;
    let bodies = world.bodies().filter_map(|id| world.body(id)).filter(|body| body.kind() == BodyKind::Dynamic);
    let mut slow = 0;
    for body in bodies {
        let p = body.position();
        assert!(p.y > -1.3, "a body fell through the floor: {p}");
        assert!(p.y < 8.0 && p.x.abs() < 13.5 && p.z.abs() < 13.5, "a body left the courtyard: {p}");
        slow += usize::from(body.linear_velocity().length() < 0.1);
    }
    assert!(slow > 585, "only {slow} of 601 bodies are at rest");
}
