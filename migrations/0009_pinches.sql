-- Where a film of a droplet closed. Runs of earlier programs have no row here.
CREATE TABLE pinches (
    job INTEGER PRIMARY KEY REFERENCES jobs,
    x REAL NOT NULL, -- of the film
    y REAL NOT NULL
);

CREATE VIEW pinch_events AS
SELECT jobs.job_id, outcomes.t_end AS t, outcomes.r_end AS r, pinches.x, pinches.y
FROM pinches
JOIN jobs ON jobs.key = pinches.job
JOIN outcomes ON outcomes.job = pinches.job
WHERE +jobs.physics_version = (SELECT physics_version FROM current);
