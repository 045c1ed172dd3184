//! The path of a droplet, fading backwards.

use crate::report::colours::PATH;
use crate::report::svg::{points, px};
use crate::report::view::View;
use crate::results::outline::Outline;
use std::fmt::Write;

/// Most pieces of a path, each paler than the next.
const PIECES: usize = 24;

/// The path `[t, x, y]` up to the outline.
pub(super) fn trail(path: &[[f64; 3]], outline: &Outline, view: &View) -> String {
    let line = visible(path, outline, view);
    let stroke = px((0.012 * view.scale).clamp(1.2, 2.2));
    let mut out = format!(
        "<g class=\"path\" fill=\"none\" stroke=\"{PATH}\" stroke-width=\"{stroke}\" stroke-linejoin=\"round\">\n"
    );
    let length = line.len().saturating_sub(1).div_ceil(PIECES).max(1);
    let pieces = line.len().saturating_sub(1).div_ceil(length);
    for piece in 0..pieces {
        let part = &line[piece * length..line.len().min((piece + 1) * length + 1)];
        let opacity = 0.2 + 0.65 * (piece + 1) as f64 / pieces as f64;
        let _ = writeln!(out, "<polyline points=\"{}\" opacity=\"{opacity:.2}\"/>", points(part.iter().copied()));
    }
    out + "</g>\n"
}

/// The part of the path to draw, in pixels, from where it enters the view to the centroid of the outline.
fn visible(path: &[[f64; 3]], outline: &Outline, view: &View) -> Vec<[f64; 2]> {
    let past = path.iter().take_while(|[t, ..]| *t < outline.t).map(|&[_, x, y]| view.place(x, y));
    let [cx, cy] = outline.centroid();
    let mut line: Vec<[f64; 2]> = Vec::new();
    for [u, v] in past.chain(std::iter::once(view.place(cx, cy))) {
        // A droplet at rest is recorded again and again at one place.
        if line.last().is_none_or(|[a, b]| (a - u).abs() + (b - v).abs() > 0.5) {
            line.push([u, v]);
        }
    }
    let [width, height] = view.size();
    let seen = |[u, v]: &[f64; 2]| (0.0..width).contains(u) && (0.0..height).contains(v);
    // The last point outside keeps the line going to the edge.
    let first = line.iter().position(seen).unwrap_or(0).saturating_sub(1);
    line.split_off(first)
}
