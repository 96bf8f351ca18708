//! Puts a recording, the viewer and three.js into one HTML file.
//!
//! The template's `{{names}}` are replaced in one pass from front to back, so that text that is put in is never searched
//! again: a title that contains `{{scene}}` stays a title. The title is escaped for HTML; all data is base64, which
//! cannot end an element; the scripts are checked by a test not to contain `</script`. The page forbids itself every
//! network access by its content security policy.

use super::codec::compress;
use super::recording::{BodyInfo, FrameTable, Geometry, Recording, ShapeInstance, Thinning, in_page};
use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

const TEMPLATE: &str = include_str!("../../page/template.html");
const STYLE: &str = include_str!("../../page/replay.css");
/// In the order in which they need each other; they become one script.
const SCRIPTS: [&str; 3] =
    [include_str!("../../page/data.js"), include_str!("../../page/stage.js"), include_str!("../../page/replay.js")];
const THREE: &str = include_str!("../../page/three.bundle.js");
const THREE_LICENSE: &str = include_str!("../../page/THREE-LICENSE");

/// What went into a page.
///
/// ```
/// use arbiter3d_cli::replay::{Recording, RecordingOptions};
/// # let path = std::env::temp_dir().join(format!("arbiter3d-empty-page-{}.html", std::process::id()));
/// let statistics = Recording::new(RecordingOptions::new("empty", 0.1)).write_html(&path)?;
/// assert_eq!(statistics.frames, 0);
/// assert!(statistics.bytes < 1_000_000);
/// # std::fs::remove_file(path)?;
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageStatistics {
    /// Size of the file.
    pub bytes: usize,
    /// Of it, poses.
    pub pose_bytes: usize,
    /// Of it, arbiters and contacts.
    pub detail_bytes: usize,
    /// Frames in it.
    pub frames: usize,
    /// Frames with arbiters and contacts in it.
    pub detail_frames: usize,
    /// What was left out, in the words that the page shows; empty if nothing was.
    pub notes: Vec<String>,
}

/// Everything of a recording but its compressed blocks.
#[derive(Serialize)]
struct SceneData<'a> {
    title: &'a str,
    frame_seconds: f64,
    position_step: f64,
    detail_step: f64,
    top_speed: f64,
    geometries: &'a [Geometry],
    shapes: &'a [ShapeInstance],
    bodies: &'a [BodyInfo],
    frames: &'a FrameTable,
    /// First frame and number of frames.
    chunks: Vec<[usize; 2]>,
    detail_frames: Vec<usize>,
    detail_stride: usize,
    notes: &'a [String],
}

impl Recording {
    /// Writes everything recorded so far as one page. The recording can go on afterwards.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_html(&mut self, path: impl AsRef<Path>) -> io::Result<PageStatistics> {
        self.flush()?;
        let mut output = Counter { inner: BufWriter::new(File::create(path)?), bytes: 0 };
        self.write_page(&mut output)?;
        output.inner.flush()?;
        let notes = self.notes();
        Ok(PageStatistics {
            bytes: output.bytes,
            pose_bytes: self.chunks.iter().map(|chunk| in_page(chunk.bytes.len())).sum(),
            detail_bytes: self.detail_samples().iter().map(|sample| in_page(sample.bytes.len())).sum(),
            frames: self.frames(),
            detail_frames: self.detail_samples().len(),
            notes,
        })
    }

    fn write_page(&self, output: &mut impl Write) -> io::Result<()> {
        let mut rest = TEMPLATE;
        while let Some((before, after)) = rest.split_once("{{") {
            output.write_all(before.as_bytes())?;
            let (name, after) = after.split_once("}}").unwrap_or((after, ""));
            self.write_part(name, output)?;
            rest = after;
        }
        output.write_all(rest.as_bytes())
    }

    fn write_part(&self, name: &str, output: &mut impl Write) -> io::Result<()> {
        match name {
            "title" => output.write_all(escape(&self.options.title).as_bytes()),
            "style" => output.write_all(STYLE.as_bytes()),
            "script" => output.write_all(SCRIPTS.concat().as_bytes()),
            "three" => output.write_all(THREE.as_bytes()),
            "three_license" => output.write_all(THREE_LICENSE.trim().as_bytes()),
            "scene" => self.write_scene(output),
            "chunks" => self.chunks.iter().try_for_each(|chunk| write_block(output, "chunk", &chunk.bytes)),
            "details" => {
                self.detail_samples().iter().try_for_each(|sample| write_block(output, "detail", &sample.bytes))
            }
            _ => Err(io::Error::other(format!("the page's template asks for an unknown part, {name:?}"))),
        }
    }

    fn write_scene(&self, output: &mut impl Write) -> io::Result<()> {
        let (position_step, detail_step) = self.steps();
        let notes = self.notes();
        let data = SceneData {
            title: &self.options.title,
            frame_seconds: self.options.frame_seconds,
            position_step,
            detail_step,
            top_speed: self.top_speed(),
            geometries: &self.geometries,
            shapes: &self.shapes,
            bodies: &self.bodies,
            frames: &self.table,
            chunks: self.chunks.iter().map(|chunk| [chunk.first_frame, chunk.frames]).collect(),
            detail_frames: self.detail_samples().iter().map(|sample| sample.frame).collect(),
            detail_stride: self.detail_stride(),
            notes: &notes,
        };
        write_block(output, "scene", &compress(&serde_json::to_vec(&data)?)?)
    }

    /// What is not in the page, in words.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for &Thinning { frame, stride } in &self.thinning {
            let time = self.table.times.get(frame).copied().unwrap_or_default();
            notes.push(format!("From {time:.2} s on, poses are kept every {stride} frames, to limit the page's size."));
        }
        if self.detail_samples().is_empty() && self.frames() > 0 {
            notes.push("Arbiters and contacts were not recorded.".into());
        } else if self.detail_stride() > 1 {
            let stride = self.detail_stride();
            notes.push(format!("Arbiters and contacts are kept every {stride} frames, to limit the page's size."));
        }
        notes
    }
}

fn write_block(output: &mut impl Write, class: &str, bytes: &[u8]) -> io::Result<()> {
    writeln!(output, "<script type=\"text/plain\" class=\"{class}\">{}</script>", STANDARD.encode(bytes))
}

/// Text as HTML text.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            other => escaped.push(other),
        }
    }
    escaped
}

/// Counts the bytes that pass.
struct Counter<W> {
    inner: W,
    bytes: usize,
}

impl<W: Write> Write for Counter<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(buffer)?;
        self.bytes += written;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::super::recording::RecordingOptions;
    use super::*;

    fn page(title: &str) -> String {
        let mut bytes = Vec::new();
        Recording::new(RecordingOptions::new(title, 0.1)).write_page(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn a_title_cannot_break_out_of_the_page() {
        let page = page("</title><script>alert('{{three}}')</script> & more");
        let escaped = "&lt;/title&gt;&lt;script&gt;alert(&#39;{{three}}&#39;)&lt;/script&gt; &amp; more";
        assert!(page.contains(&format!("<title>{escaped} ")), "{}", &page[..400]);
        assert!(!page.contains("<script>alert"));
    }

    #[test]
    fn no_inlined_script_can_end_its_element() {
        for script in SCRIPTS.into_iter().chain([THREE]) {
            assert!(!script.to_ascii_lowercase().contains("</script"));
            assert!(!script.contains("<!--"));
        }
        assert!(!STYLE.to_ascii_lowercase().contains("</style"));
    }

    #[test]
    fn every_part_of_the_template_is_filled_in() {
        let page = page("test");
        assert!(page.starts_with("<!doctype html>"));
        assert!(page.ends_with("</html>\n"));
        assert!(page.contains("default-src 'none'"));
        assert!(page.contains("Permission is hereby granted"), "the licence of three.js goes where its code goes");
        for address in ["src=\"http", "href=\"http", "url(http", "@import"] {
            assert!(!page.contains(address), "{address}");
        }
    }
}
