//! A campaign that is about to be forgotten becomes a store of its own in `quarantine/`.
//!
//! The copy begins with the whole database and with second names of the files that hold anything of the campaign. Then
//! all other campaigns are taken out of it. What the campaign shares with them is in both stores.

use crate::store::checkpoint_file::job_of;
use crate::store::error::StoreError;
use crate::store::folders::{Folders, aside_dir, database, files_in, forgetting_dir, samples_dir};
use crate::store::forget::division::{Division, Share};
use crate::store::forget::removal;
use crate::store::write::{Store, catalogue};
use crate::store::{aside, disk, quarantine, sample_file, schema, seal};
use rusqlite::OptionalExtension;
use std::path::{Path, PathBuf};

/// Makes the store of the campaigns that go; when this returns it is whole, under its name and on disk.
pub(super) fn keep(store: &Store, goes: &Division, name: &str) -> Result<PathBuf, StoreError> {
    let (path, work) = (database(&store.dir), forgetting_dir(&store.dir));
    let others =
        Division::of(&store.conn, |campaign| !goes.campaigns.contains(&campaign)).map_err(StoreError::sql(&path))?;
    disk::remove_folder(&work)?;
    disk::create_folder(&samples_dir(&work))?;
    Folders::of(&work).create()?;
    schema::copy_to(&store.conn, &path, &database(&work))?;
    link_samples(store, &others, &work)?;
    link_checkpoints(store, &others, &work)?;
    removal::take_out(&mut Store::open(&work)?, &others)?;
    if !seal::path(&work).exists() {
        // Closing a store does without a seal where there is no room for it; a store that is kept shall have one.
        seal::close(&work)?;
    }
    let folders = Folders::of(&work);
    let parts = [samples_dir(&work), aside_dir(&work), folders.checkpoints(), folders.dumps(), work.clone()];
    parts.iter().try_for_each(|folder| disk::sync_folder(folder))?;
    let place = quarantine::place_for_campaign(&store.dir, name)?;
    disk::rename(&work, &place)?;
    disk::sync_folder(place.parent().unwrap_or(&store.dir))?;
    disk::sync_folder(&store.dir)?;
    Ok(place)
}

/// Gives the copy the sample files that hold a row of a job that stays in it.
fn link_samples(store: &Store, others: &Division, work: &Path) -> Result<(), StoreError> {
    let path = database(&store.dir);
    for listed in catalogue::list(&store.conn).map_err(StoreError::sql(&path))? {
        let jobs = listed.jobs(&store.conn).map_err(StoreError::sql(&path))?;
        if others.share(&jobs) != Share::All {
            let name = &listed.file.name;
            sample_file::verify(&store.dir, name, &listed.file.checksum)?;
            disk::link(&aside::find(&store.dir, name), &name.home(work))?;
        }
    }
    Ok(())
}

/// Gives the copy the unfinished trajectories and the dumps of the jobs that stay in it.
fn link_checkpoints(store: &Store, others: &Division, work: &Path) -> Result<(), StoreError> {
    let path = database(&store.dir);
    let mut find = store.conn.prepare("SELECT key FROM jobs WHERE job_id = ?1").map_err(StoreError::sql(&path))?;
    let (from, to) = (store.folders(), Folders::of(work));
    for (from, to) in [(from.checkpoints(), to.checkpoints()), (from.dumps(), to.dumps())] {
        for file in files_in(&from)? {
            let Some(job) = job_of(&file) else { continue };
            let key = find.query_row([job.to_string()], |row| row.get(0)).optional().map_err(StoreError::sql(&path))?;
            if key.is_some_and(|key| !others.takes(key)) {
                disk::link(&file, &to.join(file.file_name().unwrap_or_default()))?;
            }
        }
    }
    Ok(())
}
