-- How runs ended, what lambda would be if those that time cut off had clogged, Weibull's shape, and from which displacement
-- on runs count. All are NULL until the next fit. The steps of the survival curve of each point.
DROP VIEW lambda_fits;
DROP VIEW speed_averages;

ALTER TABLE lambda_rows ADD COLUMN by_distance INTEGER;
ALTER TABLE lambda_rows ADD COLUMN by_time INTEGER;
ALTER TABLE lambda_rows ADD COLUMN beyond_box INTEGER;
ALTER TABLE lambda_rows ADD COLUMN lambda_if_stuck REAL;
ALTER TABLE lambda_rows ADD COLUMN weibull_shape REAL;
ALTER TABLE lambda_rows ADD COLUMN weibull_low REAL;
ALTER TABLE lambda_rows ADD COLUMN weibull_high REAL;
ALTER TABLE lambda_rows ADD COLUMN r_from REAL;
ALTER TABLE speed_rows ADD COLUMN by_distance INTEGER;
ALTER TABLE speed_rows ADD COLUMN by_time INTEGER;
ALTER TABLE speed_rows ADD COLUMN arrested INTEGER;

CREATE TABLE survival_rows (
    point INTEGER NOT NULL REFERENCES points,
    r REAL NOT NULL,
    at_risk INTEGER NOT NULL,
    clogs INTEGER NOT NULL,
    survival REAL NOT NULL,
    survival_low REAL,
    survival_high REAL,
    PRIMARY KEY (point, r)
);

CREATE VIEW survival AS
SELECT points.point_id, r, at_risk, clogs, survival, survival_low, survival_high
FROM survival_rows
JOIN points ON points.key = survival_rows.point;

CREATE VIEW lambda_fits AS
SELECT
    model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, n_vertices, dt,
    runs, clogs, lambda, lambda_low, lambda_high, lambda_least_squares, p_exponential, runs_for_ten_percent,
    wrap_share, squeeze_share, hybrid_share,
    point_id, lambda AS decay_length, saturated, box_size, bond, delta, eps, wall, contact, gravity, self_contact,
    engulfed, w, angle, tip_radius, offset, h_start, h_end, alpha, integrator, t_max, distance, ek_threshold,
    sample_every, shapes_every, dynamics, step_error, arrested,
    by_distance, by_time, beyond_box, lambda_if_stuck, weibull_shape, weibull_low, weibull_high, r_from
FROM lambda_rows
JOIN points ON points.key = lambda_rows.point;

CREATE VIEW speed_averages AS
SELECT
    model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, n_vertices, dt,
    runs, flowing, v_g, v_g_low, v_g_high, ca,
    point_id, saturated, box_size, bond, delta, eps, wall, contact, gravity, self_contact, engulfed, w, angle,
    tip_radius, offset, h_start, h_end, alpha, integrator, t_max, distance, ek_threshold, sample_every, shapes_every,
    dynamics, step_error, by_distance, by_time, arrested
FROM speed_rows
JOIN points ON points.key = speed_rows.point;
