//! Meshes from Wavefront OBJ files.
//!
//! The `tobj` crate reads the format; its errors name no line. So the lines that matter here, `v` and `f`, are checked
//! first, and the complaint names the line.

use super::format::{MeshSpec, SidesSpec, UpAxis};
use crate::problem::Problem;
use arbiter3d::{MeshSides, Shape, ShapeError, TriangleMesh, math::Vec3};
use std::path::Path;
use std::sync::Arc;

/// A mesh and how many triangles without area it was rid of.
pub(super) struct LoadedMesh {
    pub shape: Shape,
    pub left_out: usize,
}

/// Reads the mesh in the OBJ file at `path` as `spec` wants it.
pub(super) fn load(path: &Path, spec: &MeshSpec) -> Result<LoadedMesh, Problem> {
    let bytes =
        std::fs::read(path).map_err(|reason| Problem::File { action: "read", path: path.to_owned(), reason })?;
    build(&String::from_utf8_lossy(&bytes), spec).map_err(|(line, message)| Problem::MeshFile {
        path: path.to_owned(),
        line,
        message,
    })
}

/// Line (0 for the whole file) and complaint.
type Complaint = (usize, String);

fn build(text: &str, spec: &MeshSpec) -> Result<LoadedMesh, Complaint> {
    check_lines(text)?;
    let (vertices, mut triangles) = parse(text)?;
    let scale = spec.scale.map_or(1.0, |scale| scale.0);
    let turn = |v: Vec3| match spec.up {
        UpAxis::Y => v * scale,
        UpAxis::Z => Vec3::new(v.x, v.z, -v.y) * scale,
    };
    let vertices = vertices.into_iter().map(turn).collect();
    // A negative scale mirrors the mesh, which turns its triangles inside out.
    if spec.flip != (scale < 0.0) {
        triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    let sides = match spec.sides {
        SidesSpec::One => MeshSides::One,
        SidesSpec::Two => MeshSides::Two,
    };
    let (mesh, left_out) = TriangleMesh::cleaned(vertices, triangles, sides).map_err(|error| match error {
        ShapeError::EmptyMesh => (0, "there is no face with an area in it".into()),
        error => (0, error.to_string()),
    })?;
    Ok(LoadedMesh { shape: Shape::Mesh(Arc::new(mesh)), left_out })
}

fn parse(text: &str) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), Complaint> {
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|error| (0, format!("not a mesh that can be read: {error}")))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for mesh in models.into_iter().map(|model| model.mesh) {
        let first = vertices.len() as u32;
        vertices.extend(mesh.positions.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])));
        triangles.extend(mesh.indices.chunks_exact(3).map(|t| [first + t[0], first + t[1], first + t[2]]));
    }
    Ok((vertices, triangles))
}

/// Checks coordinates and face indices line by line.
fn check_lines(text: &str) -> Result<(), Complaint> {
    let mut vertices = Vertices { so_far: 0, in_all: text.lines().filter(|line| is_vertex(line)).count() as i64 };
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        let checked = match words.next() {
            Some("v") => {
                vertices.so_far += 1;
                check_vertex(words)
            }
            Some("f") => check_face(words, vertices),
            _ => Ok(()),
        };
        checked.map_err(|message| (index + 1, message))?;
    }
    Ok(())
}

fn check_vertex<'a>(words: impl Iterator<Item = &'a str>) -> Result<(), String> {
    let mut count = 0;
    for word in words {
        count += 1;
        match word.parse::<f32>() {
            Ok(number) if number.is_finite() => {}
            Ok(_) => return Err(format!("coordinate {word} is not finite")),
            Err(_) => return Err(format!("{word:?} is not a number")),
        }
    }
    if count >= 3 { Ok(()) } else { Err(format!("a vertex needs three coordinates, this one has {count}")) }
}

/// How many vertices a face may refer to.
#[derive(Clone, Copy)]
struct Vertices {
    so_far: i64,
    in_all: i64,
}

fn is_vertex(line: &str) -> bool {
    line.split_whitespace().next() == Some("v")
}

/// Indices count from 1; negative ones count back from the last vertex so far. Only those into the vertices matter.
fn check_face<'a>(words: impl Iterator<Item = &'a str>, vertices: Vertices) -> Result<(), String> {
    let mut corners = 0;
    for word in words {
        corners += 1;
        let index = word.split('/').next().unwrap_or_default();
        match index.parse::<i64>() {
            Ok(index) if (1..=vertices.in_all).contains(&index) || (-vertices.so_far..=-1).contains(&index) => {}
            Ok(index) if index < 0 => {
                let count = vertices.so_far;
                return Err(format!("face index {index} is out of range: there are {count} vertices above this line"));
            }
            Ok(index) => {
                let count = vertices.in_all;
                return Err(format!("face index {index} is out of range: the file has {count} vertices"));
            }
            Err(_) => return Err(format!("{word:?} is not a face index")),
        }
    }
    if corners >= 3 { Ok(()) } else { Err(format!("a face needs three corners, this one has {corners}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\n";

    fn spec() -> MeshSpec {
        serde_json::from_str(r#"{"file": "x.obj"}"#).unwrap()
    }

    fn mesh(text: &str, spec: &MeshSpec) -> (Arc<TriangleMesh>, usize) {
        let loaded = build(text, spec).map_err(|(line, message)| format!("{line}: {message}")).unwrap();
        let Shape::Mesh(mesh) = loaded.shape else { panic!("not a mesh") };
        (mesh, loaded.left_out)
    }

    fn normal(mesh: &TriangleMesh, triangle: usize) -> Vec3 {
        let [a, b, c] = mesh.triangles()[triangle].map(|i| mesh.vertices()[i as usize]);
        (b - a).cross(c - a)
    }

    #[test]
    fn polygons_are_split_and_flat_triangles_counted() {
        let text = format!("{SQUARE}f 1 2 3 4\nf 1 2 2\nf -4//7 -3/1 -2/2/3\n");
        let (mesh, left_out) = mesh(&text.replace("//7", "").replace("/1", "").replace("/2/3", ""), &spec());
        assert_eq!((mesh.triangles().len(), left_out), (3, 1));
        assert!((0..3).all(|t| normal(&mesh, t).y > 0.0));
    }

    #[test]
    fn scale_flip_and_up_axis_do_what_they_say() {
        let text = format!("{SQUARE}f 1 2 3\n");
        let with = |json: &str| serde_json::from_str::<MeshSpec>(json).unwrap();
        let (flipped, _) = mesh(&text, &with(r#"{"file": "x", "flip": true, "scale": 2}"#));
        assert!(normal(&flipped, 0).y < 0.0 && flipped.vertices()[2] == Vec3::new(2.0, 0.0, 2.0));
        // A face that looks along z looks up when z is up.
        let facing_z = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
        let (turned, _) = mesh(facing_z, &with(r#"{"file": "x", "up": "z"}"#));
        assert!(normal(&turned, 0).y > 0.0);
        let (mirrored, _) = mesh(&text, &with(r#"{"file": "x", "scale": -1}"#));
        assert!(normal(&mirrored, 0).y < 0.0, "a floor seen from above is a ceiling after a point reflection");
    }

    #[test]
    fn faces_may_stand_before_their_vertices() {
        let (mesh, _) = mesh(&format!("f 1 2 3\n{SQUARE}"), &spec());
        assert_eq!(mesh.triangles().len(), 1);
    }

    #[test]
    fn two_objects_make_one_mesh() {
        let text = format!("o a\n{SQUARE}f 1 2 3\no b\nv 9 0 0\nf 1 2 5\n");
        let (mesh, _) = mesh(&text, &spec());
        assert_eq!(mesh.triangles().len(), 2);
        assert!(mesh.triangles().as_flattened().iter().any(|&i| mesh.vertices()[i as usize].x == 9.0));
    }

    #[test]
    fn broken_lines_are_named() {
        let cases = [
            ("v 0 0\n", 1, "three coordinates"),
            ("# a\nv 0 nan 0\n", 2, "not finite"),
            ("v 0 1e999 0\n", 1, "not finite"),
            ("v 0 zero 0\n", 1, "not a number"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 4, "face index 4 is out of range: the file has 3 vertices"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", 4, "face index 0 is out of range"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", 4, "face index -4"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", 4, "three corners"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", 4, "not a face index"),
            ("v 0 0 0\n", 0, "no face"),
            ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", 0, "no face with an area"),
        ];
        for (text, line, part) in cases {
            let complaint = build(text, &spec()).err().unwrap();
            assert!(complaint.0 == line && complaint.1.contains(part), "{text:?} gives {complaint:?}");
        }
    }
}
