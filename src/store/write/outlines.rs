//! Saving the shapes of droplets.

use crate::results::outline::Outline;
use rusqlite::{Connection, params};

/// Replaces the shapes of a job. A shape that is none, as of a droplet that came apart, is left out.
pub(super) fn save_outlines<'a>(
    conn: &Connection,
    job: i64,
    outlines: impl IntoIterator<Item = &'a Outline>,
) -> rusqlite::Result<()> {
    conn.prepare_cached("DELETE FROM shape_rows WHERE job = ?1")?.execute([job])?;
    let mut insert = conn.prepare_cached("INSERT OR REPLACE INTO shape_rows VALUES (?1, ?2, ?3, ?4)")?;
    for Outline { t, x, y, loads } in outlines.into_iter().filter(|outline| outline.is_sound()) {
        let vertices: Vec<u8> = x.iter().chain(y).flat_map(|c| c.to_le_bytes()).collect();
        let loads = serde_json::to_string(loads).expect("loads hold only plain numbers");
        insert.execute(params![job, t, vertices, loads])?;
    }
    Ok(())
}
