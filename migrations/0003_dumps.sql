-- What a failed run left to be looked at: `meniscus replay` takes the file up where the run was last saved.
ALTER TABLE outcomes ADD COLUMN dump TEXT; -- within the store's folder

CREATE VIEW failures AS
SELECT jobs.job_id, outcomes.error_class, outcomes.error, outcomes.error_step AS step, outcomes.dump
FROM outcomes
JOIN jobs ON jobs.key = outcomes.job
WHERE outcomes.error_class IS NOT NULL AND +jobs.physics_version = (SELECT physics_version FROM current);
