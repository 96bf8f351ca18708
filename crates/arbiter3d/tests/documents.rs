//! The guide holds together: its links lead somewhere, no chapter is left out, and its snippets are all tested.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The guide's chapters by file name, without its table of contents.
fn chapters() -> Vec<String> {
    let names =
        fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut chapters: Vec<String> = names.filter(|name| name.ends_with(".md") && name != "SUMMARY.md").collect();
    chapters.sort();
    chapters
}

/// Targets of the links of a page that lead to files.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.map(|target| target.split('#').next().unwrap()).filter(|t| !t.is_empty() && !t.contains("://")).collect()
}

#[test]
fn links_lead_to_files() {
    let guide = chapters().into_iter().map(|name| format!("docs/{name}"));
    for page in guide.chain(["README.md".into(), "CHANGELOG.md".into(), "docs/SUMMARY.md".into()]) {
        let path = root().join(&page);
        let text = fs::read_to_string(&path).unwrap();
        for link in links(&text) {
            assert!(path.parent().unwrap().join(link).exists(), "{page} links to {link}, which does not exist");
        }
    }
}

#[test]
fn the_table_of_contents_has_every_chapter() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    for chapter in chapters() {
        assert!(summary.contains(&format!("]({chapter})")), "docs/SUMMARY.md lacks {chapter}");
    }
}

#[test]
fn every_chapter_with_rust_is_compiled() {
    let compiled = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/guide.rs")).unwrap();
    for chapter in chapters() {
        let text = fs::read_to_string(root().join("docs").join(&chapter)).unwrap();
        let listed = compiled.contains(&format!("\"docs/{chapter}\""));
        assert!(listed || !text.contains("```rust"), "src/guide.rs lacks docs/{chapter}");
    }
}
