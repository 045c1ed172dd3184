//! The obstacles that a droplet met, worked out from the scene and the seed of its job.

use crate::campaign::checks;
use crate::parameters::{Point, Scene};
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::store::error::StoreError;
use crate::store::read::rows::JobRow;
use crate::store::read::{corrupt, outlines, parse_point};
use rusqlite::{Connection, OptionalExtension};
use std::collections::HashSet;
use std::path::Path;

/// How far from the droplet's path the surface of an obstacle may be to be listed, in sigma.
const REACH: f64 = 1.0;

/// Most cells of the array that are looked into along a path. A run of 2e4 samples needs a hundredth of it.
const MOST_CELLS: f64 = 1e8;

/// The discs within [`REACH`] of the recorded path of a droplet's centre and of its kept outlines, by x, then by y. A
/// periodic image has the number of its original and a place of its own. None where the scene has no discs, and where
/// they could not be placed, which is why the job failed.
pub(super) fn near_path(conn: &Connection, job_id: &str) -> Result<Vec<JobRow>, StoreError> {
    let sql_error = |error| StoreError::sql(Path::new(conn.path().unwrap_or_default()))(error);
    let Some((spec, seed)) = job(conn, job_id).map_err(sql_error)? else { return Ok(Vec::new()) };
    let point = parse_point(&spec, job_id)?;
    checks::validate(&point).map_err(|problem| corrupt(job_id, problem))?;
    let Some(array) = array_of(&point, seed as u64) else { return Ok(Vec::new()) };
    let mut near = Near { array, seen: HashSet::new(), found: Vec::new(), cells: 0.0 };
    near.follow(&path(conn, job_id).map_err(sql_error)?);
    for outline in outlines::read(conn, job_id).map_err(sql_error)? {
        let outline = outline.ok_or_else(|| corrupt(job_id, "its outline cannot be read".to_owned()))?;
        near.follow(&outline.x.iter().zip(&outline.y).map(|(&x, &y)| [x, y]).collect::<Vec<_>>());
    }
    if near.cells > MOST_CELLS {
        return Err(corrupt(job_id, "its path leads further than a droplet can move".to_owned()));
    }
    near.found.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    let radius = near.array.radius;
    Ok(near.found.into_iter().map(|(id, x, y)| [i64::from(id).into(), x.into(), y.into(), radius.into()]).collect())
}

/// The point and the seed of a job.
fn job(conn: &Connection, job_id: &str) -> rusqlite::Result<Option<(String, i64)>> {
    let mut statement = conn.prepare_cached(
        "SELECT points.spec, jobs.seed FROM jobs JOIN points ON points.key = jobs.point WHERE job_id = ?1",
    )?;
    statement.query_row([job_id], |row| Ok((row.get(0)?, row.get(1)?))).optional()
}

/// The recorded path of the droplet's centre.
fn path(conn: &Connection, job_id: &str) -> rusqlite::Result<Vec<[f64; 2]>> {
    let mut statement = conn.prepare_cached("SELECT h, y FROM samples WHERE job_id = ?1 ORDER BY t")?;
    statement.query_map([job_id], |row| Ok([row.get(0)?, row.get(1)?]))?.collect()
}

fn array_of(point: &Point, seed: u64) -> Option<ObstacleArray> {
    match &point.scene {
        Scene::Obstacles(field) => ObstacleArray::generate(field, seed).ok(),
        Scene::Disc(disc) => Some(ObstacleArray::lone(0.5 * disc.sigma_ob)),
        Scene::Channel(_) | Scene::Plate => None,
    }
}

/// The discs found so far.
struct Near {
    array: ObstacleArray,
    /// Number and place of each, bit for bit.
    seen: HashSet<(u32, u64, u64)>,
    found: Vec<(u32, f64, f64)>,
    /// Cells of the array that were looked into.
    cells: f64,
}

impl Near {
    /// Adds the discs near a line through these points.
    fn follow(&mut self, line: &[[f64; 2]]) {
        let (first, last) = (line.first(), line.last());
        let ends = line.iter().zip(line.iter().skip(1)).chain(first.zip(last).filter(|_| line.len() == 1));
        for (&a, &b) in ends {
            self.look_along(a, b);
        }
    }

    /// Adds the discs near the straight line from `a` to `b`.
    fn look_along(&mut self, a: [f64; 2], b: [f64; 2]) {
        let far = REACH + self.array.radius;
        let [x, y] = [0, 1].map(|i| [a[i].min(b[i]) - far, a[i].max(b[i]) + far]);
        self.cells += self.array.cells_in([x[1] - x[0], y[1] - y[0]]);
        if self.cells > MOST_CELLS || self.cells.is_nan() {
            self.cells = f64::INFINITY;
            return;
        }
        let (seen, found) = (&mut self.seen, &mut self.found);
        // In coordinates of the box itself a disc has the same bits wherever it is seen from.
        self.array.for_each_in([0.0; 2], [x[0], x[1], y[0], y[1]], |disc| {
            let near = distance([disc.x, disc.y], a, b) <= far;
            if near && seen.insert((disc.id, disc.x.to_bits(), disc.y.to_bits())) {
                found.push((disc.id, disc.x, disc.y));
            }
        });
    }
}

/// The distance from `p` to the straight line from `a` to `b`.
fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length = along[0] * along[0] + along[1] * along[1];
    let share = if length > 0.0 { ((along[0] * to[0] + along[1] * to[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    let [x, y] = [to[0] - share * along[0], to[1] - share * along[1]];
    (x * x + y * y).sqrt()
}
