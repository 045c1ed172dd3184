//! A droplet among its obstacles as an SVG picture: its outline, its path, the forces that hold it, and a caption.
//!
//! Arrows end where an obstacle pushes and are as long as the force is strong; the dark one is the droplet's weight on the same scale, so
//! at a clog the red ones add up to its opposite. The outline is as wide as the vertices, delta.

use crate::parameters::{MASS, Model};
use crate::report::caption::Caption;
use crate::report::surroundings::Surroundings;
use crate::report::svg::{arrow, circle, points, px, text};
pub use crate::report::view::View;
use crate::results::outline::Outline;
use std::fmt::Write;

const WATER: &str = "#56a8e2";
const WATER_EDGE: &str = "#0f4c81";
const PATH: &str = "#2f6f9f";
const FORCE: &str = "#d7263d";
const WEIGHT: &str = "#22303f";
const INK: &str = "#1c2733";
const PALE_INK: &str = "#5d6b7a";
const GROUND: &str = "#f6f8fa";

/// Length of the arrow of one weight, and the most of the strongest force, in sigma.
const ARROW: [f64; 2] = [0.45, 0.8];

/// Forces below this share of the weight get a dot and no arrow.
const WEAK: f64 = 0.01;

/// Pieces into which a path is cut to fade.
const PIECES: usize = 24;

/// Size of the letters of a caption, in pixels.
const SMALL: f64 = 13.0;

/// Room round the scene, in pixels.
const FRAME: f64 = 16.0;

/// Everything a picture needs besides the outline and the view.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// The walls.
    pub surroundings: &'a Surroundings,
    /// Path of the centroid, `[t, x, y]`, by time.
    pub path: &'a [[f64; 3]],
    /// The words.
    pub caption: Caption<'a>,
}

impl Picture<'_> {
    /// The picture of one outline, a whole SVG document.
    pub fn svg(&self, outline: &Outline, view: &View) -> String {
        let [width, height] = view.size();
        let scene = [
            self.surroundings.draw(view, outline),
            self.trail(outline, view),
            self.droplet(outline, view),
            forces(outline, view),
        ];
        let (words, words_height) = self.words(outline, width, height + 2.0 * FRAME);
        let (full_width, full_height) = (px(width + 2.0 * FRAME), px(height + 2.0 * FRAME + words_height));
        let title = crate::report::svg::escape(&self.caption.title());
        let mut out = String::new();
        let _ = write!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{full_width}\" height=\"{full_height}\" \
             viewBox=\"0 0 {full_width} {full_height}\" font-family=\"DejaVu Sans, Verdana, sans-serif\">\n\
             <title>{title}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
             <svg x=\"{FRAME}\" y=\"{FRAME}\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"{GROUND}\"/>\n{}{}</svg>\n{words}</svg>\n",
            scene.concat(),
            signs(view),
        );
        out
    }

    /// The droplet itself.
    fn droplet(&self, outline: &Outline, view: &View) -> String {
        let delta = match &self.caption.point.model {
            Model::Deformable(ring) => ring.delta,
            Model::Soft(_) => 0.012,
        };
        let style = format!(
            "class=\"droplet\" fill=\"{WATER}\" fill-opacity=\"0.5\" stroke=\"{WATER_EDGE}\" stroke-width=\"{}\" \
             stroke-linejoin=\"round\"",
            px((delta * view.scale).clamp(0.8, 4.0))
        );
        if let ([x], [y]) = (outline.x.as_slice(), outline.y.as_slice()) {
            return circle(view.place(*x, *y), 0.5 * view.scale, &style);
        }
        let ring = outline.x.iter().zip(&outline.y).map(|(&x, &y)| view.place(x, y));
        format!("<polygon points=\"{}\" {style}/>\n", points(ring))
    }

    /// The path up to the outline, fading backwards.
    fn trail(&self, outline: &Outline, view: &View) -> String {
        let past = self.path.iter().take_while(|[t, ..]| *t < outline.t).map(|&[_, x, y]| view.place(x, y));
        let [cx, cy] = outline.centroid();
        let mut line: Vec<[f64; 2]> = Vec::new();
        for [u, v] in past.chain(std::iter::once(view.place(cx, cy))) {
            // A droplet at rest is recorded again and again at one place.
            if line.last().is_none_or(|[a, b]| (a - u).abs() + (b - v).abs() > 0.5) {
                line.push([u, v]);
            }
        }
        // What left the view upwards need not be drawn; a point more keeps the line going to the edge.
        let [width, height] = view.size();
        let seen = |[u, v]: &[f64; 2]| (0.0..width).contains(u) && (0.0..height).contains(v);
        let first = line.iter().position(seen).unwrap_or(0).saturating_sub(1);
        let line = &line[first..];
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

    /// Legend and caption below the scene, from `top` on, and their height.
    fn words(&self, outline: &Outline, width: f64, top: f64) -> (String, f64) {
        let start_x = self.path.first().map(|[_, x, _]| *x);
        let caption = self.caption;
        let mut y = top + 14.0;
        let mut out =
            text([FRAME, y], 18.0, "start", &format!("fill=\"{INK}\" font-weight=\"bold\""), &caption.title());
        let details = [caption.reason().map(str::to_owned), Some(caption.parameters())];
        let mut lines: Vec<(String, &str)> = Vec::new();
        // A letter is about 0.55 of its size wide.
        let letters = (width / (0.55 * SMALL)) as usize;
        for detail in details.into_iter().flatten() {
            lines.extend(broken(&detail, letters).into_iter().map(|line| (line, INK)));
        }
        lines.extend(caption.instant(outline, start_x).map(|line| (line, PALE_INK)));
        y += 6.0;
        for (line, colour) in lines {
            y += 20.0;
            out += &text([FRAME, y], SMALL, "start", &format!("fill=\"{colour}\""), &line);
        }
        (out, y + 14.0 - top)
    }
}

/// The loads and the weight.
fn forces(outline: &Outline, view: &View) -> String {
    let strength = |fx: f64, fy: f64| (fx * fx + fy * fy).sqrt() / MASS;
    let strongest = outline.loads.iter().map(|load| strength(load.fx, load.fy)).fold(1.0, f64::max);
    // Sigma per weight.
    let length = ARROW[0].min(ARROW[1] / strongest);
    let (width, head) = ((0.02 * view.scale).clamp(1.0, 4.0), (0.11 * view.scale).clamp(4.0, 20.0));
    let mut out = "<g class=\"forces\">\n".to_owned();
    let [x, y] = outline.centroid();
    out += &arrow(view.place(x, y), view.place(x + length, y), width, head, WEIGHT);
    out += &circle(view.place(x, y), 1.1 * width, &format!("fill=\"{WEIGHT}\""));
    for load in &outline.loads {
        let (to, scale) = (view.place(load.x, load.y), length / MASS);
        if strength(load.fx, load.fy) >= WEAK {
            let from = view.place(load.x - scale * load.fx, load.y - scale * load.fy);
            out += &arrow(from, to, width, head, FORCE);
        } else {
            out += &circle(to, width, &format!("fill=\"{FORCE}\""));
        }
    }
    out + "</g>\n"
}

/// Gravity, the scale bar, and what the arrows mean, in the corners of the scene.
fn signs(view: &View) -> String {
    let [width, height] = view.size();
    let plate = |x: f64, y: f64, w: f64, h: f64| {
        format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"5\" fill=\"#ffffff\" fill-opacity=\"0.86\"/>\n",
            px(x),
            px(y),
            px(w),
            px(h)
        )
    };
    let dark = format!("fill=\"{INK}\"");
    let mut out = plate(width - 48.0, 8.0, 40.0, 62.0);
    out += &arrow([width - 36.0, 18.0], [width - 36.0, 60.0], 2.4, 13.0, INK);
    out += &text([width - 26.0, 43.0], 15.0, "start", &format!("{dark} font-style=\"italic\""), "g");
    // One sigma, or ten where one is too small to see.
    let (bar, label) = if view.scale >= 24.0 { (view.scale, "1 σ") } else { (10.0 * view.scale, "10 σ") };
    out += &plate(8.0, height - 42.0, bar + 20.0, 34.0);
    let (left, right, base) = (px(18.0), px(18.0 + bar), height - 18.0);
    let (low, high, middle) = (px(base - 4.0), px(base + 4.0), px(base));
    let _ = writeln!(
        out,
        "<path d=\"M{left},{low}V{high}M{left},{middle}H{right}M{right},{low}V{high}\" fill=\"none\" stroke=\"{INK}\" \
         stroke-width=\"2\"/>"
    );
    out += &text([18.0 + 0.5 * bar, height - 25.0], 13.0, "middle", &dark, label);
    out += &plate(width - 138.0, height - 50.0, 130.0, 42.0);
    for (row, (colour, label)) in [(FORCE, "contact force"), (WEIGHT, "weight")].into_iter().enumerate() {
        let y = height - 35.0 + 18.0 * row as f64;
        out += &arrow([width - 130.0, y], [width - 106.0, y], 2.4, 9.0, colour);
        out += &text([width - 100.0, y + 4.0], 12.0, "start", &dark, label);
    }
    out
}

/// The text in lines of at most `letters` letters, broken at spaces.
fn broken(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
