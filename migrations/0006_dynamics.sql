-- The laws by which a deformable droplet moves, and the error of a step of those of a liquid. Older points have the laws
-- of the paper, "vertex"; the program fills the columns from their texts.

DROP VIEW runs;
DROP VIEW stale_runs;
DROP VIEW all_runs;
DROP VIEW lambda_fits;
DROP VIEW speed_averages;

ALTER TABLE points ADD COLUMN dynamics TEXT;
ALTER TABLE points ADD COLUMN step_error REAL;

CREATE VIEW all_runs AS
SELECT
    jobs.job_id, campaigns.name AS campaign, points.model, points.scene, points.gamma, points.e_w, points.w_ob,
    points.sigma_ob, points.density, points.b0, points.v_t, points.k_a, points.kappa, points.w, points.n_vertices,
    points.dt, points.integrator, jobs.seed, jobs.state, outcomes.outcome, outcomes.r_end, outcomes.t_end,
    outcomes.v_g_mean, outcomes.ek_ratio_end, outcomes.shape_max, outcomes.area_error_max, outcomes.overlap_max,
    outcomes.delta_s, outcomes.steps, outcomes.wall_s, jobs.attempts, outcomes.error_class, outcomes.error,
    jobs.physics_version,
    points.point_id, jobs.block, points.saturated, points.box_size, points.bond, points.delta, points.eps, points.wall,
    points.contact, points.gravity, points.self_contact, points.engulfed, points.angle, points.tip_radius,
    points.offset, points.h_start, points.h_end, points.alpha, points.t_max, points.distance, points.ek_threshold,
    points.sample_every, points.shapes_every, points.dynamics, points.step_error
FROM jobs
LEFT JOIN points ON points.key = jobs.point
LEFT JOIN campaigns ON campaigns.key = jobs.campaign
LEFT JOIN outcomes ON outcomes.job = jobs.key;

-- The `+` keeps the index of physics versions out of it: nearly all jobs share one, so any other way in is better.
CREATE VIEW runs AS
SELECT
    job_id, campaign, model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, w, n_vertices, dt,
    integrator, seed, state, outcome, r_end, t_end, v_g_mean, ek_ratio_end, shape_max, area_error_max, overlap_max,
    delta_s, steps, wall_s, attempts, error_class, error,
    point_id, block, saturated, box_size, bond, delta, eps, wall, contact, gravity, self_contact, engulfed, angle,
    tip_radius, offset, h_start, h_end, alpha, t_max, distance, ek_threshold, sample_every, shapes_every,
    dynamics, step_error
FROM all_runs
WHERE +physics_version = (SELECT physics_version FROM current);

CREATE VIEW stale_runs AS
SELECT
    job_id, campaign, model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, w, n_vertices, dt,
    integrator, seed, state, outcome, r_end, t_end, v_g_mean, ek_ratio_end, shape_max, area_error_max, overlap_max,
    delta_s, steps, wall_s, attempts, error_class, error,
    point_id, block, saturated, box_size, bond, delta, eps, wall, contact, gravity, self_contact, engulfed, angle,
    tip_radius, offset, h_start, h_end, alpha, t_max, distance, ek_threshold, sample_every, shapes_every,
    dynamics, step_error
FROM all_runs
WHERE physics_version <> (SELECT physics_version FROM current);

CREATE VIEW lambda_fits AS
SELECT
    model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, n_vertices, dt,
    runs, clogs, lambda, lambda_low, lambda_high, lambda_least_squares, p_exponential, runs_for_ten_percent,
    wrap_share, squeeze_share, hybrid_share,
    point_id, lambda AS decay_length, saturated, box_size, bond, delta, eps, wall, contact, gravity, self_contact,
    engulfed, w, angle, tip_radius, offset, h_start, h_end, alpha, integrator, t_max, distance, ek_threshold,
    sample_every, shapes_every, dynamics, step_error
FROM lambda_rows
JOIN points ON points.key = lambda_rows.point;

CREATE VIEW speed_averages AS
SELECT
    model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, n_vertices, dt,
    runs, flowing, v_g, v_g_low, v_g_high, ca,
    point_id, saturated, box_size, bond, delta, eps, wall, contact, gravity, self_contact, engulfed, w, angle,
    tip_radius, offset, h_start, h_end, alpha, integrator, t_max, distance, ek_threshold, sample_every, shapes_every,
    dynamics, step_error
FROM speed_rows
JOIN points ON points.key = speed_rows.point;
