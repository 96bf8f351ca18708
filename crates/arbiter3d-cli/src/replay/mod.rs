//! Records a run and writes it as one HTML page that replays it in 3D, without a network.
//!
//! Three parts, each a file: [`Recording`] takes frames as they come and keeps them compressed; `codec` turns poses and
//! `detail` turns contacts into few bytes; `page` puts those bytes, the viewer's script and three.js into one file.
//!
//! The recording knows nothing of the engine: its input is plain numbers, so that anything that has bodies with poses
//! can be replayed.
//!
//! # The file
//!
//! Every block of data is zlib-compressed and base64-coded inside a `<script type="text/plain">` element:
//!
//! | block | content |
//! |---|---|
//! | scene | JSON: geometry, shapes, bodies, the time and the counts of every frame, the tables of the blocks below |
//! | pose chunks | consecutive frames; the first one stands alone, so that the slider can jump to any chunk |
//! | detail samples | arbiters and contacts of one frame each |
//!
//! Poses are kept for every frame until the page would pass [`RecordingOptions::page_limit_bytes`]; then later frames are
//! thinned. Contact details are sampled as densely as [`RecordingOptions::page_target_bytes`] allows, evenly over
//! the run. The page says so wherever either has happened: nothing is left out in silence.

mod codec;
mod detail;
mod page;
mod recording;

pub use page::PageStatistics;
pub use recording::{
    ArbiterSample, BodyInfo, BodyKind, BodySample, BodyState, ContactDetail, ContactSample, Frame, Geometry, Recording,
    RecordingError, RecordingOptions, ShapeInstance,
};
