-- Droplets that were at rest, or nearly so, when their time ran out: each with the stable equilibrium that lay ahead. Runs
-- of earlier programs were not judged, and have no row here.
CREATE TABLE arrests (
    job INTEGER PRIMARY KEY REFERENCES jobs,
    r REAL NOT NULL, -- of the equilibrium
    x REAL NOT NULL,
    y REAL NOT NULL,
    way_left REAL NOT NULL,
    energy_left REAL NOT NULL
);

CREATE VIEW arrest_events AS
SELECT jobs.job_id, arrests.r, arrests.x, arrests.y, arrests.way_left, arrests.energy_left
FROM arrests
JOIN jobs ON jobs.key = arrests.job
WHERE +jobs.physics_version = (SELECT physics_version FROM current);

-- How many of the clogs of a point are arrests.
DROP VIEW lambda_fits;

ALTER TABLE lambda_rows ADD COLUMN arrested INTEGER;

CREATE VIEW lambda_fits AS
SELECT
    model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, n_vertices, dt,
    runs, clogs, lambda, lambda_low, lambda_high, lambda_least_squares, p_exponential, runs_for_ten_percent,
    wrap_share, squeeze_share, hybrid_share,
    point_id, lambda AS decay_length, saturated, box_size, bond, delta, eps, wall, contact, gravity, self_contact,
    engulfed, w, angle, tip_radius, offset, h_start, h_end, alpha, integrator, t_max, distance, ek_threshold,
    sample_every, shapes_every, dynamics, step_error, arrested
FROM lambda_rows
JOIN points ON points.key = lambda_rows.point;
