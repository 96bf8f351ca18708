//! The results as a picture for a page that may be light or dark.
//!
//! One panel for each number of threads, one row for each scene, one bar for each engine. Within a row, bars are as long as
//! their time against the fastest peer's, whose length is the same in all rows and marked by a line: what ends left of the
//! line beats every peer. Bars past the edge are cut. Failed runs are hollow. All colours are of middle brightness on no
//! background, so that they are legible on white and on near-black.

use super::{Row, geometric_means, ratios};
use crate::engine::Kind;
use std::fmt::Write;

const NAME: f64 = 118.0;
const LABEL: f64 = 58.0;
const CHART: f64 = 250.0;
const RATIO: f64 = 62.0;
const PANEL: f64 = LABEL + CHART + RATIO;
const GAP: f64 = 24.0;
const BAR: f64 = 9.0;
const PITCH: f64 = 12.0;
const ROW_GAP: f64 = 12.0;
const TOP: f64 = 78.0;
/// The fastest peer's bar as a share of the chart.
const UNIT: f64 = 0.4;
const TEXT: &str = "#768390";

fn color(kind: Kind) -> &'static str {
    match kind {
        Kind::Arbiter => "#e5682c",
        Kind::Box3d => "#4a86cf",
        Kind::Rapier => "#9a7fc9",
        Kind::Jolt => "#4f9d69",
    }
}

/// Draws all rows.
pub fn draw(rows: &[Row]) -> String {
    let scenes = distinct(rows.iter().map(|row| row.scene.as_str()));
    let engines = distinct(rows.iter().map(|row| row.engine));
    let threads = distinct(rows.iter().map(|row| row.threads));
    let height = engines.len() as f64 * PITCH + ROW_GAP;
    let width = NAME + threads.len() as f64 * (PANEL + GAP);
    let total = TOP + scenes.len() as f64 * height + 8.0;
    let mut svg = String::new();
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {total}\" width=\"{width}\" height=\"{total}\" \
         font-family=\"system-ui, -apple-system, 'Segoe UI', Helvetica, Arial, sans-serif\" font-size=\"11\" fill=\"{TEXT}\">"
    );
    svg.push_str("<title>Milliseconds per step of arbiter3d and its peers</title>\n");
    legend(&mut svg, &engines);
    for (index, scene) in scenes.iter().enumerate() {
        let y = TOP + index as f64 * height + 0.5 * (height - ROW_GAP) + 4.0;
        text(&mut svg, [NAME - 8.0, y], "end", 600, scene);
    }
    for (panel, &threads) in threads.iter().enumerate() {
        let left = NAME + panel as f64 * (PANEL + GAP);
        heading(&mut svg, left, threads, rows, TOP + scenes.len() as f64 * height);
        for (index, scene) in scenes.iter().enumerate() {
            let here: Vec<&Row> = rows.iter().filter(|row| row.scene == *scene && row.threads == threads).collect();
            row(&mut svg, [left, TOP + index as f64 * height], &here);
        }
    }
    svg.push_str("</svg>\n");
    svg
}

fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

fn text(svg: &mut String, at: [f64; 2], anchor: &str, weight: u32, words: &str) {
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" font-weight=\"{weight}\">{words}</text>",
        at[0], at[1]
    );
}

fn legend(svg: &mut String, engines: &[Kind]) {
    let mut x = NAME;
    for &kind in engines {
        let _ = writeln!(svg, "<rect x=\"{x}\" y=\"6\" width=\"12\" height=\"12\" rx=\"2\" fill=\"{}\"/>", color(kind));
        text(svg, [x + 17.0, 16.0], "start", 600, kind.name());
        x += 40.0 + 7.0 * kind.name().len() as f64;
    }
    let note = "milliseconds per step; the line is the fastest peer, shorter is faster; hollow: failed";
    text(svg, [NAME, 36.0], "start", 400, note);
}

/// The number of threads, the geometric mean and the line of the fastest peer.
fn heading(svg: &mut String, left: f64, threads: usize, rows: &[Row], bottom: f64) {
    let plural = if threads == 1 { "" } else { "s" };
    text(svg, [left + LABEL, 62.0], "start", 600, &format!("{threads} thread{plural}"));
    if let Some(mean) = geometric_means(&ratios(rows)).get(&threads) {
        text(svg, [left + PANEL, 62.0], "end", 600, &format!("{mean:.2} × as fast, geometric mean"));
    }
    let x = left + LABEL + UNIT * CHART;
    let _ = writeln!(
        svg,
        "<line x1=\"{x:.1}\" y1=\"{:.1}\" x2=\"{x:.1}\" y2=\"{bottom:.1}\" stroke=\"{TEXT}\" stroke-dasharray=\"2 3\" \
         stroke-opacity=\"0.7\"/>",
        TOP - 6.0
    );
}

/// The bars of one scene in one panel.
fn row(svg: &mut String, corner: [f64; 2], rows: &[&Row]) {
    let peers = rows.iter().filter(|row| row.engine != Kind::Arbiter && row.counts());
    let fastest = peers.map(|row| row.median()).reduce(f64::min);
    let slowest = rows.iter().map(|row| row.median()).fold(0.0, f64::max);
    // Without a peer to compare with, the slowest bar fills the chart.
    let unit = fastest.unwrap_or(UNIT * slowest);
    for (index, row) in rows.iter().enumerate() {
        let y = corner[1] + index as f64 * PITCH;
        if row.means.is_empty() {
            continue;
        }
        let left = corner[0] + LABEL;
        let share = if unit > 0.0 { UNIT * row.median() / unit } else { 0.0 };
        bar(svg, [left, y], share, color(row.engine), row.failure.is_some());
        text(svg, [left - 5.0, y + 8.0], "end", 400, &short(row.median()));
        if let (Kind::Arbiter, Some(fastest), None) = (row.engine, fastest, &row.failure) {
            let ratio = format!("{:.2} ×", fastest / row.median());
            text(svg, [left + CHART + RATIO, y + 8.0], "end", 600, &ratio);
        }
    }
}

/// A bar of a share of the chart; one that does not fit ends in a slanted cut.
fn bar(svg: &mut String, at: [f64; 2], share: f64, color: &str, hollow: bool) {
    let [x, y] = at;
    let paint = if hollow {
        format!("fill=\"none\" stroke=\"{color}\" stroke-dasharray=\"3 2\"")
    } else {
        format!("fill=\"{color}\"")
    };
    if share > 1.0 {
        let (end, low) = (x + CHART, y + BAR);
        let slant = end - 5.0;
        let _ = writeln!(svg, "<path d=\"M{x:.1} {y:.1}H{end:.1}L{slant:.1} {low:.1}H{x:.1}Z\" {paint}/>");
    } else {
        let width = (share * CHART).max(1.0);
        let _ =
            writeln!(svg, "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{BAR}\" rx=\"1.5\" {paint}/>");
    }
}

/// Three digits that matter; microseconds below a tenth of a millisecond.
fn short(time: f64) -> String {
    match time {
        t if t >= 100.0 => format!("{t:.0}"),
        t if t >= 10.0 => format!("{t:.1}"),
        t if t >= 0.1 => format!("{t:.2}"),
        t if t >= 0.01 => format!("{:.1} µs", 1e3 * t),
        t => format!("{:.2} µs", 1e3 * t),
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn each_time_has_a_bar_of_its_length() {
        let svg = draw(&samples::rows());
        let bars = svg.matches("height=\"9\"").count() + svg.matches("<path").count();
        assert_eq!(bars, samples::rows().len(), "{svg}");
        // The fastest peer of `a` ends at the line, we at half of it.
        assert!(svg.contains("width=\"100.0\" height=\"9\" rx=\"1.5\" fill=\"#4a86cf\""), "{svg}");
        assert!(svg.contains("width=\"50.0\" height=\"9\" rx=\"1.5\" fill=\"#e5682c\""), "{svg}");
        assert!(svg.contains("0.50 ×") && svg.contains("2.00 ×") && svg.contains("1 thread<"), "{svg}");
        assert!(svg.contains("stroke-dasharray=\"3 2\""), "the failed one is hollow: {svg}");
        assert_eq!(svg.matches("<svg").count(), svg.matches("</svg>").count());
    }
}
