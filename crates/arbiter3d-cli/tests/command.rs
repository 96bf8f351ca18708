//! The `arbiter3d` command from outside: what it prints, writes and refuses.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own for each test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("arbiter3d-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: &str) -> String {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap()
    }

    fn command(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_arbiter3d")).args(arguments).current_dir(&self.0).output().unwrap()
    }

    /// Runs the command, which must end with code 2 and one line, and gives the line.
    fn complaint(&self, arguments: &[&str]) -> String {
        let output = self.command(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?} said {text}");
        assert!(output.stdout.is_empty(), "{arguments:?} printed a result");
        assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?} said {text}");
        text.trim_end().to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn shipped(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).to_str().unwrap().to_owned()
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_run_writes_its_summary_rows_and_page() {
    let folder = Folder::new("outputs");
    let output = folder.command(&["run", "bounce", "--steps", "30", "--json", "a.json", "--csv", "a.csv"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let table = String::from_utf8(output.stdout).unwrap();
    for word in ["scene", "time a step", "bodies", "arbiters", "deepest penetration", "kinetic energy", "state hash"] {
        assert!(table.contains(word), "the table lacks {word}:\n{table}");
    }
    let page = Path::new("target/arbiter3d/bounce.html");
    assert!(table.contains(page.to_str().unwrap()), "{table}");
    assert!(folder.read(page.to_str().unwrap()).starts_with("<!"), "the page is not HTML");
    let summary = json(&folder.read("a.json"));
    assert_eq!(summary["scene"], "bounce");
    for (key, value) in [("steps", 30), ("threads", 1), ("bodies", 12)] {
        assert_eq!(summary[key], value, "{key}");
    }
    for key in [
        "ms_per_step",
        "awake",
        "arbiters",
        "contacts",
        "deepest_penetration",
        "kinetic_energy",
        "potential_energy",
        "mean_height",
        "min_height",
        "max_height",
    ] {
        assert!(summary[key].is_number(), "{key} is {}", summary[key]);
    }
    assert!(summary["simd"].is_string() && summary["phases"].is_object());
    let hash = summary["state_hash"].as_str().unwrap();
    assert!(hash.len() == 16 && table.contains(hash));
    let rows: Vec<String> = folder.read("a.csv").lines().map(String::from).collect();
    assert_eq!(rows.len(), 31);
    let columns: Vec<&str> = rows[0].split(',').collect();
    assert!(columns.starts_with(&["step", "time", "ms"]) && columns.ends_with(&["potential_energy", "state_hash"]));
    assert!(rows.iter().all(|row| row.split(',').count() == columns.len()));
    assert!(rows[30].starts_with("30,0.5") && rows[30].ends_with(hash));
}

/// Half a second of free fall from 5.5 m: the mean height after it is that of the formula.
#[test]
fn heights_in_the_summary_are_physical() {
    let folder = Folder::new("heights");
    folder.command(&["run", "bounce", "--steps", "30", "--no-html", "--json", "a.json"]);
    let mean = json(&folder.read("a.json"))["mean_height"].as_f64().unwrap();
    let expected = 5.5 - 0.5 * 9.81 * 0.25;
    assert!((mean - expected).abs() < 1e-3, "{mean}, expected {expected}");
    assert!(!folder.0.join("target").exists(), "--no-html must write no page");
}

#[test]
fn threads_levels_and_page_do_not_change_the_state_but_seeds_do() {
    let folder = Folder::new("hashes");
    let hash = |extra: &[&str]| {
        let mut arguments = vec!["run", "boxes_rain", "--size", "60", "--steps", "100", "--json", "h.json"];
        arguments.extend(extra);
        let output = folder.command(&arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        json(&folder.read("h.json"))["state_hash"].as_str().unwrap().to_owned()
    };
    let first = hash(&["--no-html"]);
    assert_eq!(first, hash(&["--html", "page.html"]));
    assert_eq!(first, hash(&["--no-html", "--threads", "2"]));
    assert_eq!(first, hash(&["--no-html", "--simd", "scalar"]));
    assert_ne!(first, hash(&["--no-html", "--seed", "9"]));
}

#[test]
fn list_names_every_scene_once() {
    let folder = Folder::new("list");
    let text = String::from_utf8(folder.command(&["list"]).stdout).unwrap();
    assert_eq!(text.lines().count(), arbiter3d_scenes::SCENES.len());
    assert!(text.lines().zip(arbiter3d_scenes::SCENES).all(|(line, scene)| line.starts_with(scene.name)));
}

#[test]
fn bench_measures_all_combinations_and_they_agree() {
    let folder = Folder::new("bench");
    let arguments =
        ["bench", "bounce", "ramps", "--threads", "1,2", "--simd", "scalar", "--steps", "5", "--rounds", "2"];
    let output = folder.command(&[&arguments[..], &["--json", "b.json"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let results = json(&folder.read("b.json"));
    let results = results.as_array().unwrap();
    assert_eq!(results.len(), 4);
    for result in results {
        assert!(result["median_ms_per_step"].as_f64() >= result["min_ms_per_step"].as_f64());
        assert!(result["min_ms_per_step"].as_f64().unwrap() > 0.0);
    }
    assert_eq!(results[0]["state_hash"], results[1]["state_hash"]);
}

#[test]
fn help_explains_itself() {
    let folder = Folder::new("help");
    let text = String::from_utf8(folder.command(&["--help"]).stdout).unwrap();
    assert!(text.contains("Examples:") && text.contains("arbiter3d list") && text.contains("bench"));
    let text = String::from_utf8(folder.command(&["run", "--help"]).stdout).unwrap();
    assert!(text.contains("--threads") && text.contains("colosseum_break") && text.contains("scene-format.md"));
}

#[test]
fn the_shipped_scenes_run() {
    let folder = Folder::new("shipped");
    for (file, dynamic) in [("hello.json", 4), ("courtyard.json", 601)] {
        let output = folder.command(&["run", &shipped(file), "--steps", "20", "--json", "s.json"]);
        assert!(output.status.success(), "{file}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(json(&folder.read("s.json"))["dynamic"], dynamic, "{file}");
    }
    assert!(folder.0.join("target/arbiter3d/courtyard.html").exists());
}

#[test]
fn wrong_scenes_and_options_are_one_line() {
    let folder = Folder::new("options");
    let line = folder.complaint(&["run", "collosseum"]);
    assert!(line.contains("\"collosseum\"") && line.contains("did you mean colosseum"), "{line}");
    assert!(folder.complaint(&["run", "xyzzy"]).contains("arbiter3d list"));
    assert!(folder.complaint(&["run", "no\nsuch"]).contains("no scene"));
    for (arguments, part) in [
        (vec!["run", "bounce", "--steps", "-1"], "--steps"),
        (vec!["run", "bounce", "--hz", "inf"], "--hz"),
        (vec!["run", "bounce", "--threads", "many"], "--threads"),
        (vec!["run", "bounce", "--simd", "mmx"], "this machine has"),
        (vec!["run", "bounce", "--bogus"], "--bogus"),
        (vec!["run", "bounce", "--html", "a.html", "--no-html"], "--no-html"),
        (vec!["run", "bounce", "--json", "no/such/folder/a.json"], "no/such/folder/a.json"),
        (vec!["run", "bounce", "--html", "no/such/folder/a.html"], "no/such/folder/a.html"),
        (vec!["run", "large_pyramid", "--size", "999999"], "size is 999999: it must be from 1 to 1000"),
        (vec!["bench", "nothing_of_the_kind"], "nothing_of_the_kind"),
        (vec!["frobnicate"], "frobnicate"),
    ] {
        let line = folder.complaint(&arguments);
        assert!(line.contains(part), "{arguments:?} said {line}");
    }
}

#[test]
fn broken_scene_files_are_one_line_with_the_place() {
    let folder = Folder::new("files");
    assert!(folder.complaint(&["run", "missing.json"]).contains("cannot read missing.json"));
    assert!(folder.complaint(&["run", &folder.path("")]).contains("cannot read"));
    for (text, part) in [
        ("{\"bodies\": [", "line 1 column 12"),
        ("{\"bodies\": [{\"position\": [0, NaN, 0]}]}", "bodies[0].position[1]: NaN"),
        ("{\"bodies\": [{\"position\": [0, 1e999, 0]}]}", "bodies[0].position[1]: number out of range"),
        ("{\"bodies\": [{\"position\": [0, 1e39, 0]}]}", "bodies[0].position[1]: 1e39 is too large"),
        ("{\"bodies\": [{\"mass\": 0, \"shapes\": [{\"sphere\": {\"radius\": 1}}]}]}", "bodies[0].mass"),
        ("{\"bodies\": [{\"shapes\": [{\"sphere\": {\"radius\": 0}}]}]}", "bodies[0].shapes[0].sphere"),
        ("{\"worlds\": {}}", "unknown field `worlds`"),
        ("{\"meshes\": {\"a\": {\"file\": \"gone.obj\"}}}", "gone.obj"),
    ] {
        let file = folder.write("scene.json", text);
        let line = folder.complaint(&["run", &file, "--no-html"]);
        assert!(line.contains("scene.json") || line.contains("gone.obj"), "{line}");
        assert!(line.contains(part), "{text} said {line}");
    }
    std::fs::write(folder.0.join("scene.json"), [b'{', b'\n', 0xff, 0xfe]).unwrap();
    assert!(folder.complaint(&["run", "scene.json"]).contains("line 2 is not UTF-8"));
}

#[test]
fn broken_meshes_are_one_line_with_the_line_number() {
    let folder = Folder::new("meshes");
    let scene = r#"{"meshes": {"m": {"file": "m.obj"}}, "bodies": [{"kind": "KIND", "shapes": [{"mesh": "m"}]}]}"#;
    let file = folder.write("scene.json", &scene.replace("KIND", "static"));
    for (text, part) in [
        ("v 0 0 0\nv 0 0 1\nv 1 0 0\nf 1 2 9\n", "m.obj:4: face index 9 is out of range"),
        ("v 0 0 0\nv 0 nan 1\nv 1 0 0\nf 1 2 3\n", "m.obj:2: coordinate nan is not finite"),
        ("v 0 0 0\nv 0 0 1\nv 1 0 0\nf 1 2\n", "m.obj:4: a face needs three corners"),
        ("", "m.obj: there is no face"),
    ] {
        folder.write("m.obj", text);
        let line = folder.complaint(&["run", &file, "--no-html"]);
        assert!(line.contains(part), "{text:?} said {line}");
    }
    folder.write("m.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nf 1 2 3\nf 1 1 2\n");
    let dynamic = folder.write("dynamic.json", &scene.replace("KIND", "dynamic"));
    // The note on dropped triangles comes first here: only the last line is the complaint.
    let output = folder.command(&["run", &dynamic, "--no-html"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(2)
            && text.contains("bodies[0].shapes[0]: 3 edges of the mesh have no matching neighbour"),
        "{text}"
    );
    let output = folder.command(&["run", &file, "--no-html", "--steps", "1"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && text.contains("left out 1 triangles without area"), "{text}");
}
