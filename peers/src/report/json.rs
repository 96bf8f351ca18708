//! The results for machines.

use super::{Row, geometric_means, ratios, worst};
use crate::engine::Kind;
use serde_json::{Map, Value, json};

/// All results as one JSON value: `rows`, `geomean` by number of threads, `worst`.
pub fn value(rows: &[Row]) -> Value {
    let ratios = ratios(rows);
    let ratio_of = |row: &Row| {
        let same = ratios.iter().find(|ratio| ratio.scene == row.scene && ratio.threads == row.threads);
        same.filter(|_| row.engine == Kind::Arbiter).map(|ratio| ratio.ratio)
    };
    let means: Map<String, Value> =
        geometric_means(&ratios).into_iter().map(|(threads, mean)| (threads.to_string(), json!(mean))).collect();
    let worst = worst(&ratios)
        .map(|w| json!({ "scene": w.scene, "threads": w.threads, "ratio": w.ratio, "peer": w.peer.name() }));
    let rows: Vec<Value> = rows.iter().map(|row| row_value(row, ratio_of(row))).collect();
    json!({ "rows": rows, "geomean": means, "worst": worst })
}

fn row_value(row: &Row, ratio: Option<f64>) -> Value {
    let quality = &row.quality;
    json!({
        "scene": row.scene,
        "engine": row.engine.name(),
        "threads": row.threads,
        "ms_median": row.median(),
        "ms_min": row.fastest(),
        "ms_floor": row.floor(),
        "ms_worst_tenth": row.worst_tenth,
        "ms_repetitions": row.means,
        "contacts": row.contacts,
        "mean_height": quality.mean_height,
        "deepest_penetration": quality.deepest_penetration,
        "failed": row.failure.is_some(),
        "reason": row.failure,
        "timed_out": row.timed_out,
        "ratio": ratio,
        "bodies": row.bodies,
        "steps": row.steps,
        "contact_points": quality.points,
        "awake": quality.awake,
        "drift": quality.drift,
        "drift_z": quality.drift_z,
        "lost": quality.lost,
        "kinetic_energy": quality.kinetic_energy,
        "bytes": row.bytes[0],
        "peak_bytes": row.bytes[1],
    })
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn the_shape_is_as_documented() {
        let value = value(&samples::rows());
        let keys: Vec<&String> = value.as_object().unwrap().keys().collect();
        assert_eq!(keys, ["geomean", "rows", "worst"]);
        assert!((value["geomean"]["2"].as_f64().unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(value["worst"]["scene"], "b");
        assert_eq!((value["worst"]["threads"].as_u64(), value["worst"]["ratio"].as_f64()), (Some(1), Some(0.5)));
        let first = &value["rows"][0];
        assert_eq!((first["engine"].as_str(), first["threads"].as_u64()), (Some("arbiter3d"), Some(1)));
        assert_eq!((first["ms_median"].as_f64(), first["ms_min"].as_f64()), (Some(1.0), Some(0.9)));
        assert_eq!((&first["failed"], &first["contacts"]), (&Value::Bool(false), &json!(40)));
        assert!(first["mean_height"].is_number() && first["deepest_penetration"].is_number());
        assert_eq!(value["rows"][3]["failed"], true);
        assert_eq!(value["rows"][3]["reason"], "fell");
    }

    #[test]
    fn without_a_peer_there_is_nothing_to_compare() {
        let value = value(&[samples::row("a", Kind::Arbiter, 1, &[1.0])]);
        assert!(value["worst"].is_null() && value["geomean"].as_object().unwrap().is_empty());
    }
}
