//! The obstacle arrays that jobs share. Each is made once, and kept while a job still needs it: jobs announce
//! themselves before the first of them starts, get their array when they start, and release it at their end.

use crate::parameters::{Job, ObstacleField, Scene};
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::results::trajectory::Failure;
use std::collections::HashMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// What names one array: the canonical form of its field, and the seed.
type ArrayKey = (String, u64);

/// The array once it is made; none if it was not made because all jobs are to stop.
type Slot = Arc<OnceLock<Result<Option<Arc<ObstacleArray>>, Failure>>>;

/// One array and the number of jobs that will still ask for it.
#[derive(Debug, Default)]
struct Entry {
    jobs_left: usize,
    slot: Slot,
}

/// Arrays by field and seed.
#[derive(Debug, Default)]
pub struct ArrayLibrary {
    entries: Mutex<HashMap<ArrayKey, Entry>>,
}

impl ArrayLibrary {
    /// Counts a job that will ask for its array later.
    pub(crate) fn announce(&self, job: &Job) {
        let Some(key) = key_of(job) else { return };
        self.lock().entry(key).or_default().jobs_left += 1;
    }

    /// The array of `field` for the job, made when the first job asks. The discs of saturated arrays are placed later,
    /// where droplets come. `None` if `stop` is set before it is made.
    ///
    /// # Errors
    /// Those of [`ObstacleArray::generate`].
    pub(crate) fn get(
        &self,
        job: &Job,
        field: &ObstacleField,
        stop: &AtomicBool,
    ) -> Result<Option<Arc<ObstacleArray>>, Failure> {
        let slot = key_of(job).map_or_else(Slot::default, |key| self.lock().entry(key).or_default().slot.clone());
        // Generated outside the lock, so that jobs wait only for their own array.
        let make = || Ok(ObstacleArray::generate_unless(stop, field, job.seed)?.map(Arc::new));
        slot.get_or_init(make).clone()
    }

    /// Releases the array of the job; the last job frees it.
    pub(crate) fn release(&self, job: &Job) {
        let Some(key) = key_of(job) else { return };
        let mut entries = self.lock();
        if let Some(entry) = entries.get_mut(&key) {
            entry.jobs_left = entry.jobs_left.saturating_sub(1);
            if entry.jobs_left == 0 {
                entries.remove(&key);
            }
        }
    }

    /// The map. A panic of another thread cannot leave it inconsistent, because every change is one statement.
    fn lock(&self) -> MutexGuard<'_, HashMap<ArrayKey, Entry>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn key_of(job: &Job) -> Option<ArrayKey> {
    let Scene::Obstacles(field) = &job.point.scene else { return None };
    Some((serde_json::to_string(field).expect("a field holds only plain numbers"), job.seed))
}
