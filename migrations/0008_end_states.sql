-- Where each trajectory was at the check before its last one. A job of the same course with a larger time limit or distance
-- goes on from there. Series and outlines up to there are those of the job.
CREATE TABLE end_states (
    job INTEGER PRIMARY KEY REFERENCES jobs,
    course TEXT NOT NULL, -- the hash of the point without time limit and distance, the seed and the physics version
    step INTEGER NOT NULL,
    distance REAL, -- how far the job was to go; NULL where that is not limited
    state BLOB NOT NULL -- blake3 of what follows, then the state as `execute` encodes it
);
CREATE INDEX end_states_by_course ON end_states (course, step);
