//! From text to [`SceneFile`], with the JSON path, line and column of whatever is wrong.

use super::format::SceneFile;
use crate::problem::{Place, Problem};
use std::path::Path;

/// Reads and checks a scene file.
pub(super) fn read(path: &Path) -> Result<SceneFile, Problem> {
    let text = std::fs::read(path).map_err(|reason| Problem::File { action: "read", path: path.to_owned(), reason })?;
    let at = |place: Place, message: String| Problem::SceneFile { path: path.to_owned(), place, message };
    let text = String::from_utf8(text).map_err(|error| {
        let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        at(Place::default(), format!("line {line} is not UTF-8 text"))
    })?;
    parse(&text).map_err(|(place, message)| at(place, message))
}

/// Turns JSON text into a scene.
pub(super) fn parse(text: &str) -> Result<SceneFile, (Place, String)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    // Without this an array would count as an object whose fields come in order.
    if !text.trim_start().starts_with('{') {
        return Err((Place::default(), "a scene file is a JSON object: it must begin with {".into()));
    }
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let scene = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        // "." is the whole file, "?" a key that could not be read.
        let place = path.trim_end_matches('?').trim_end_matches('.').to_owned();
        (Place(place), explain(error.inner(), text))
    })?;
    deserializer.end().map_err(|error| (Place::default(), explain(&error, text)))?;
    Ok(scene)
}

/// The parser's message; where it stumbled over a NaN or an infinity, it says so instead.
fn explain(error: &serde_json::Error, text: &str) -> String {
    let rest = text.lines().nth(error.line().saturating_sub(1)).unwrap_or_default();
    // The column is where the parser stopped, within or just behind the first letters of the word.
    let from = error.column().saturating_sub(4);
    let near: String = rest.chars().skip(from).take(12).collect::<String>().to_lowercase();
    let place = format!("line {} column {}", error.line(), error.column());
    if error.is_syntax() && ["nan", "inf"].iter().any(|word| near.contains(word)) {
        return format!("NaN and infinity are not numbers here: give a finite number, at {place}");
    }
    error.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaint(text: &str) -> String {
        let (place, message) = parse(text).unwrap_err();
        format!("{place}{message}")
    }

    #[test]
    fn complaints_name_the_json_path_and_the_line() {
        let cases = [
            (r#"{"bodies": [{"position": [0, "a", 0]}]}"#, "bodies[0].position[1]: invalid type"),
            (r#"{"bodies": [{"position": [0, 0, 1e39]}]}"#, "bodies[0].position[2]: 1e39 is too large"),
            (r#"{"bodies": [{"position": [0, 1e999, 0]}]}"#, "bodies[0].position[1]: number out of range at line 1"),
            ("{\"bodies\": [\n{\"position\": [0, NaN, 0]}]}", "bodies[0].position[1]: NaN and infinity"),
            ("{\"world\": {\n\"slop\": -Infinity}}", "world.slop: NaN and infinity are not numbers"),
            (r#"{"bodies": [{"shapes": [{"cube": 1}]}]}"#, "bodies[0].shapes[0].cube: unknown field `cube`"),
            (r#"{"bodies": [{"shapes": [{"sphere": {}}]}]}"#, "bodies[0].shapes[0].sphere: missing field `radius`"),
            (r#"{"bodies": [{"kind": "rigid"}]}"#, "bodies[0].kind: unknown variant `rigid`"),
            (r#"{"meshes": {"yard": {"path": "x"}}}"#, "meshes.yard.path: unknown field"),
            (r#"{"bodies": ["#, "EOF while parsing"),
            (r#"{} {}"#, "trailing characters at line 1 column 4"),
            (r#"[]"#, "must begin with {"),
        ];
        for (text, part) in cases {
            let line = complaint(text);
            assert!(line.contains(part), "{text} gives {line}");
        }
    }

    #[test]
    fn an_empty_object_is_a_scene() {
        assert!(parse("{}").unwrap().bodies.is_empty());
        assert!(parse("\u{feff}{}").is_ok());
    }
}
