//! The results for people: one aligned line for each scene, engine and number of threads.
//!
//! `ms/step` is the median over the repetitions of the mean step, `min` the least of them, `floor` the mean over the steps of
//! the fastest time of each, `worst10%` the mean of the slowest tenth. `ratio` is the fastest peer's time over ours;
//! that peer has a 1. `contacts` is the engine's own count (of points, of pairs, as it counts); `points`, `height`
//! (mean, metres), `depth` (deepest penetration), `awake`, `drift` (sideways, metres) and `energy` are measured alike for all.

use super::{Row, geometric_means, ratios, worst};
use crate::engine::Kind;
use std::fmt::Write;

const HEADINGS: [&str; 16] = [
    "scene", "engine", "thr", "ms/step", "min", "floor", "worst10%", "ratio", "contacts", "points", "height",
    "depth mm", "awake", "drift", "energy J", "MB",
];

/// The whole table, with the geometric means and the worst scene below it.
pub fn table(rows: &[Row]) -> String {
    let ratios = ratios(rows);
    let mut cells: Vec<Vec<String>> = vec![HEADINGS.map(String::from).to_vec()];
    for row in rows {
        let ratio = ratios.iter().find(|ratio| ratio.scene == row.scene && ratio.threads == row.threads);
        let ratio = match ratio {
            Some(ratio) if row.engine == Kind::Arbiter => format!("{:.2}", ratio.ratio),
            Some(ratio) if row.engine == ratio.peer => "1".into(),
            _ => String::new(),
        };
        cells.push(line(row, ratio));
    }
    let mut text = aligned(&cells, rows);
    for (threads, mean) in geometric_means(&ratios) {
        let count = ratios.iter().filter(|ratio| ratio.threads == threads).count();
        let _ = writeln!(
            text,
            "fastest peer ÷ arbiter3d, {threads} thread{}: geometric mean {mean:.3} over {count} scenes",
            if threads == 1 { "" } else { "s" }
        );
    }
    if let Some(worst) = worst(&ratios) {
        let _ = writeln!(
            text,
            "worst scene: {} with {} thread{}, {:.2} times as fast as {}",
            worst.scene,
            worst.threads,
            if worst.threads == 1 { "" } else { "s" },
            worst.ratio,
            worst.peer.name()
        );
    }
    text
}

fn line(row: &Row, ratio: String) -> Vec<String> {
    let quality = &row.quality;
    let count = |count: Option<usize>| count.map_or("-".into(), |count| count.to_string());
    let megabytes = row.bytes[0].map_or("-".into(), |bytes| format!("{:.1}", bytes as f64 / 1e6));
    vec![
        row.scene.clone(),
        row.engine.name().into(),
        row.threads.to_string(),
        milliseconds(row.median()),
        milliseconds(row.fastest()),
        milliseconds(row.floor()),
        milliseconds(row.worst_tenth),
        ratio,
        count(row.contacts),
        quality.points.to_string(),
        format!("{:.3}", quality.mean_height),
        format!("{:.1}", 1e3 * quality.deepest_penetration),
        quality.awake.to_string(),
        format!("{:.3}", quality.drift),
        format!("{:.3e}", quality.kinetic_energy),
        megabytes,
    ]
}

/// Microseconds, and where the time is less than ten of them, nanoseconds.
fn milliseconds(time: f64) -> String {
    if time < 0.01 { format!("{time:.6}") } else { format!("{time:.3}") }
}

/// Columns padded to their widest cell: names to the left, numbers to the right; reasons of failure at the end.
fn aligned(cells: &[Vec<String>], rows: &[Row]) -> String {
    let width = |column: usize| cells.iter().map(|line| line[column].len()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..HEADINGS.len()).map(width).collect();
    let mut text = String::new();
    let mut last_scene = "";
    for (index, line) in cells.iter().enumerate() {
        if index > 0 && rows[index - 1].scene != last_scene {
            last_scene = &rows[index - 1].scene;
            text.push('\n');
        }
        for (column, (cell, &width)) in line.iter().zip(&widths).enumerate() {
            let _ = if column < 2 { write!(text, "{cell:<width$}  ") } else { write!(text, "{cell:>width$}  ") };
        }
        if let Some(reason) = index.checked_sub(1).and_then(|row| rows[row].failure.as_ref()) {
            let _ = write!(text, "FAILED: {reason}");
        }
        text.truncate(text.trim_end_matches(' ').len());
        text.push('\n');
    }
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn columns_line_up_and_failures_are_named() {
        let text = table(&samples::rows());
        let lines: Vec<&str> = text.lines().collect();
        let end = lines[0].find("ms/step").unwrap() + "ms/step".len();
        let ours = lines.iter().find(|line| line.starts_with("a ") && line.contains("arbiter3d")).unwrap();
        assert_eq!(&ours[end - 5..end], "1.000", "{text}");
        assert!(text.contains("FAILED: fell"), "{text}");
        assert!(text.contains("1 thread: geometric mean 1.000 over 2 scenes"), "{text}");
        assert!(text.contains("worst scene: b with 1 thread, 0.50 times as fast as rapier"), "{text}");
    }
}
