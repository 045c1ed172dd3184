-- What each run reports of its numerical health, beside the columns of `runs` that it shares with them.
ALTER TABLE outcomes ADD COLUMN ek_ratio_min REAL;
ALTER TABLE outcomes ADD COLUMN engulfed_t REAL;
ALTER TABLE outcomes ADD COLUMN refused INTEGER;

CREATE VIEW stability AS
SELECT
    jobs.job_id, outcomes.energy_rise_max, outcomes.area_error_max, outcomes.overlap_max, outcomes.ek_ratio_min,
    outcomes.engulfed_t, outcomes.refused, outcomes.error_class
FROM outcomes
JOIN jobs ON jobs.key = outcomes.job
WHERE +jobs.physics_version = (SELECT physics_version FROM current);
