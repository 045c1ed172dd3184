//! Columns that follow from texts of the same store: the parameters of a point from its canonical text, and the block
//! of a job from the text of its campaign.
//!
//! The text is what counts. So whatever an older program left, or left out, in these columns is written anew when a
//! database is upgraded or rescued. A text that this program cannot read stops nothing: its columns stay as they are.

use crate::campaign::file::Campaign;
use crate::parameters::Point;
use crate::store::schema::points;
use rusqlite::types::Value;
use rusqlite::{Connection, params, params_from_iter};

/// Fills these columns of all points and jobs.
pub(in crate::store) fn fill(conn: &Connection) -> rusqlite::Result<()> {
    fill_points(conn)?;
    fill_blocks(conn)
}

fn fill_points(conn: &Connection) -> rusqlite::Result<()> {
    let names = points::names();
    let places = vec!["?"; names.split(',').count()].join(", ");
    let mut fill = conn.prepare(&format!("UPDATE points SET ({names}) = ({places}) WHERE key = ?"))?;
    let mut texts = conn.prepare("SELECT key, spec FROM points")?;
    let mut rows = texts.query([])?;
    while let Some(row) = rows.next()? {
        let point = row.get_ref(1)?.as_str().ok().and_then(|spec| serde_json::from_str::<Point>(spec).ok());
        if let Some(point) = point {
            let key = Value::Integer(row.get(0)?);
            fill.execute(params_from_iter(points::values(&point).into_iter().chain([key])))?;
        }
    }
    Ok(())
}

/// A block of the text counts for the jobs that this text brought.
fn fill_blocks(conn: &Connection) -> rusqlite::Result<()> {
    let mut fill = conn.prepare(
        "UPDATE jobs SET block = ?1 WHERE block IS NULL AND campaign = ?2
         AND point = (SELECT key FROM points WHERE point_id = ?3)",
    )?;
    let mut texts = conn.prepare("SELECT key, text FROM campaigns")?;
    let mut rows = texts.query([])?;
    while let Some(row) = rows.next()? {
        let campaign: i64 = row.get(0)?;
        let readings = row.get_ref(1)?.as_str().map_or_else(|_| Vec::new(), Campaign::readings);
        for block in readings.iter().flat_map(|read| &read.blocks) {
            for point in &block.point_ids {
                fill.execute(params![block.name, campaign, point.to_string()])?;
            }
        }
    }
    Ok(())
}
