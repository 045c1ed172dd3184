-- The store, first schema. Times are unix seconds (UTC); `datetime(t, 'unixepoch')` shows them.
-- `runs`, `clog_events`, `lambda_fits` and `speed_averages` are what people query; the tables may change under them.

-- The physics version of the program that last opened the store for writing; jobs of any other version are stale.
CREATE TABLE current (
    only_row INTEGER PRIMARY KEY CHECK (only_row = 1),
    physics_version INTEGER NOT NULL
);

CREATE TABLE campaigns (
    key INTEGER PRIMARY KEY,
    name TEXT NOT NULL,
    text TEXT NOT NULL,
    text_hash TEXT NOT NULL,
    first_used REAL NOT NULL,
    last_used REAL NOT NULL,
    UNIQUE (name, text_hash)
);

CREATE TABLE points (
    key INTEGER PRIMARY KEY,
    point_id TEXT NOT NULL UNIQUE CHECK (length(point_id) = 20),
    spec TEXT NOT NULL,
    model TEXT NOT NULL,
    scene TEXT NOT NULL,
    gamma REAL,
    e_w REAL,
    w_ob REAL,
    sigma_ob REAL,
    density, -- discs per sigma^2, or the text 'saturated': no declared type keeps both as they are
    b0 REAL,
    v_t REAL NOT NULL,
    k_a REAL,
    kappa REAL,
    w REAL,
    n_vertices INTEGER,
    dt REAL NOT NULL,
    integrator TEXT NOT NULL
);

CREATE TABLE jobs (
    key INTEGER PRIMARY KEY,
    job_id TEXT NOT NULL UNIQUE,
    point INTEGER NOT NULL REFERENCES points,
    campaign INTEGER NOT NULL REFERENCES campaigns,
    seed INTEGER NOT NULL,
    state TEXT NOT NULL DEFAULT 'pending'
        -- not IN, which would build a list anew for every row
        CHECK (state = 'pending' OR state = 'running' OR state = 'done' OR state = 'failed'),
    attempts INTEGER NOT NULL DEFAULT 0,
    physics_version INTEGER NOT NULL
);
-- Both cover their question (the planner's ids and states, the counts of `status`), so a million jobs are counted
-- without touching the table.
CREATE INDEX jobs_by_id ON jobs (job_id, state);
CREATE INDEX jobs_by_state ON jobs (physics_version, campaign, state);
CREATE INDEX jobs_by_point ON jobs (point, seed);

CREATE TABLE provenance (
    key INTEGER PRIMARY KEY,
    program_version TEXT NOT NULL,
    git_commit TEXT NOT NULL,
    rustc TEXT NOT NULL,
    cpu_features TEXT NOT NULL,
    host TEXT NOT NULL,
    pid INTEGER NOT NULL,
    campaign INTEGER NOT NULL REFERENCES campaigns,
    started REAL NOT NULL,
    ended REAL
);

CREATE TABLE outcomes (
    job INTEGER PRIMARY KEY REFERENCES jobs,
    outcome TEXT,
    r_end REAL,
    t_end REAL,
    v_g_mean REAL,
    ek_ratio_end REAL,
    shape_max REAL,
    area_error_max REAL,
    overlap_max REAL,
    delta_s REAL,
    energy_rise_max REAL,
    steps INTEGER,
    wall_s REAL,
    error_class TEXT,
    error TEXT,
    error_step INTEGER,
    provenance INTEGER REFERENCES provenance,
    finished REAL NOT NULL,
    CHECK ((outcome IS NULL) <> (error_class IS NULL))
);
CREATE INDEX outcomes_by_time ON outcomes (provenance, finished);
CREATE INDEX outcomes_by_error ON outcomes (error_class) WHERE error_class IS NOT NULL;

CREATE TABLE clogs (
    job INTEGER PRIMARY KEY REFERENCES jobs,
    t REAL NOT NULL,
    r REAL NOT NULL,
    x REAL NOT NULL,
    y REAL NOT NULL,
    ek_ratio REAL NOT NULL,
    shape REAL,
    contacts INTEGER NOT NULL,
    mechanism TEXT
);

-- Shapes of droplets: the last of every run, failed ones too, and more where the campaign sets `shapes_every`.
CREATE TABLE shape_rows (
    job INTEGER NOT NULL REFERENCES jobs,
    t REAL NOT NULL,
    -- f64, little-endian: x of all vertices, counter-clockwise and unwrapped, then y of all; SP has one vertex
    vertices BLOB NOT NULL,
    -- JSON: [{"obstacle", "x", "y", "fx", "fy", "turn"}, ...], where a load acts, its force on the droplet, and the angle in
    -- radians by which the surface turns along the contact
    loads TEXT NOT NULL,
    PRIMARY KEY (job, t)
);

-- The catalogue: a Parquet file exists for readers only once its row is here.
CREATE TABLE sample_files (
    key INTEGER PRIMARY KEY,
    path TEXT NOT NULL UNIQUE, -- within the store's folder
    rows INTEGER NOT NULL,
    bytes INTEGER NOT NULL,
    checksum TEXT NOT NULL, -- blake3, hexadecimal
    schema_version INTEGER NOT NULL
);
CREATE TABLE sample_index (
    job INTEGER PRIMARY KEY REFERENCES jobs,
    file INTEGER NOT NULL REFERENCES sample_files,
    first_row INTEGER NOT NULL,
    row_count INTEGER NOT NULL
);

CREATE TABLE lambda_rows (
    point INTEGER PRIMARY KEY REFERENCES points,
    runs INTEGER NOT NULL,
    clogs INTEGER NOT NULL,
    lambda REAL,
    lambda_low REAL,
    lambda_high REAL,
    lambda_least_squares REAL,
    p_exponential REAL,
    runs_for_ten_percent INTEGER
);
CREATE TABLE speed_rows (
    point INTEGER PRIMARY KEY REFERENCES points,
    runs INTEGER NOT NULL,
    flowing INTEGER NOT NULL,
    v_g REAL,
    v_g_low REAL,
    v_g_high REAL,
    ca REAL
);

-- LEFT JOINs on keys that always match: SQLite leaves out those that a plain query does not read, and turns those it
-- filters on into inner ones.
CREATE VIEW all_runs AS
SELECT
    jobs.job_id, campaigns.name AS campaign, points.model, points.scene, points.gamma, points.e_w, points.w_ob,
    points.sigma_ob, points.density, points.b0, points.v_t, points.k_a, points.kappa, points.w, points.n_vertices,
    points.dt, points.integrator, jobs.seed, jobs.state, outcomes.outcome, outcomes.r_end, outcomes.t_end,
    outcomes.v_g_mean, outcomes.ek_ratio_end, outcomes.shape_max, outcomes.area_error_max, outcomes.overlap_max,
    outcomes.delta_s, outcomes.steps, outcomes.wall_s, jobs.attempts, outcomes.error_class, outcomes.error,
    jobs.physics_version
FROM jobs
LEFT JOIN points ON points.key = jobs.point
LEFT JOIN campaigns ON campaigns.key = jobs.campaign
LEFT JOIN outcomes ON outcomes.job = jobs.key;

-- The `+` keeps the index of physics versions out of it: nearly all jobs share one, so any other way in is better.
CREATE VIEW runs AS
SELECT
    job_id, campaign, model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, w, n_vertices, dt,
    integrator, seed, state, outcome, r_end, t_end, v_g_mean, ek_ratio_end, shape_max, area_error_max, overlap_max,
    delta_s, steps, wall_s, attempts, error_class, error
FROM all_runs
WHERE +physics_version = (SELECT physics_version FROM current);

CREATE VIEW stale_runs AS
SELECT
    job_id, campaign, model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, w, n_vertices, dt,
    integrator, seed, state, outcome, r_end, t_end, v_g_mean, ek_ratio_end, shape_max, area_error_max, overlap_max,
    delta_s, steps, wall_s, attempts, error_class, error
FROM all_runs
WHERE physics_version <> (SELECT physics_version FROM current);

CREATE VIEW clog_events AS
SELECT
    jobs.job_id, clogs.t, clogs.r, clogs.x, clogs.y, clogs.ek_ratio, clogs.shape, clogs.contacts, clogs.mechanism
FROM clogs
JOIN jobs ON jobs.key = clogs.job
WHERE +jobs.physics_version = (SELECT physics_version FROM current);

CREATE VIEW shapes AS
SELECT jobs.job_id, shape_rows.t, shape_rows.vertices, shape_rows.loads
FROM shape_rows
JOIN jobs ON jobs.key = shape_rows.job
WHERE +jobs.physics_version = (SELECT physics_version FROM current);

-- The shares are of the point's clogs whose mechanism is known.
CREATE VIEW lambda_fits AS
WITH shares AS (
    SELECT
        jobs.point, avg(clogs.mechanism = 'wrap') AS wrap_share, avg(clogs.mechanism = 'squeeze') AS squeeze_share,
        avg(clogs.mechanism = 'hybrid') AS hybrid_share
    FROM clogs
    JOIN jobs ON jobs.key = clogs.job
    WHERE +jobs.physics_version = (SELECT physics_version FROM current)
    GROUP BY jobs.point
)
SELECT
    model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, n_vertices, dt,
    runs, clogs, lambda, lambda_low, lambda_high, lambda_least_squares, p_exponential, runs_for_ten_percent,
    wrap_share, squeeze_share, hybrid_share
FROM lambda_rows
JOIN points ON points.key = lambda_rows.point
LEFT JOIN shares ON shares.point = lambda_rows.point;

CREATE VIEW speed_averages AS
SELECT
    model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, n_vertices, dt,
    runs, flowing, v_g, v_g_low, v_g_high, ca
FROM speed_rows
JOIN points ON points.key = speed_rows.point;
