//! A droplet among its obstacles as an SVG picture: its outline, its path, the forces that hold it, and a caption.
//!
//! The line of the outline is as wide as the vertices, delta.

use crate::parameters::Model;
use crate::report::caption::Caption;
use crate::report::colours::{GROUND, INK, PALE_INK, WATER, WATER_EDGE};
use crate::report::forces::forces;
use crate::report::signs::signs;
use crate::report::surroundings::Surroundings;
use crate::report::svg::{circle, escape, polygon, px, text};
use crate::report::trail::trail;
use crate::report::view::View;
use crate::results::outline::Outline;

/// Size of the letters of a caption, in pixels.
const SMALL: f64 = 13.0;

/// Room round the scene, in pixels.
const FRAME: f64 = 16.0;

/// What a picture needs besides the outline and the view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Picture<'a> {
    /// The walls.
    pub surroundings: &'a Surroundings,
    /// Path of the centroid, `[t, x, y]`, by time.
    pub path: &'a [[f64; 3]],
    /// The words below.
    pub caption: Caption<'a>,
}

impl Picture<'_> {
    /// The picture of one outline, a whole SVG document.
    pub(crate) fn svg(&self, outline: &Outline, view: &View) -> String {
        let [width, height] = view.size();
        let scene = [
            self.surroundings.draw(view, outline),
            trail(self.path, outline, view),
            self.droplet(outline, view),
            forces(outline, view),
        ];
        let (words, words_height) = self.words(outline, width, height + 2.0 * FRAME);
        let (full_width, full_height) = (px(width + 2.0 * FRAME), px(height + 2.0 * FRAME + words_height));
        let title = escape(&self.caption.title(outline));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{full_width}\" height=\"{full_height}\" \
             viewBox=\"0 0 {full_width} {full_height}\" font-family=\"DejaVu Sans, Verdana, sans-serif\">\n\
             <title>{title}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
             <svg x=\"{FRAME}\" y=\"{FRAME}\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"{GROUND}\"/>\n{}{}</svg>\n{words}</svg>\n",
            scene.concat(),
            signs(view),
        )
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
        polygon(outline.x.iter().zip(&outline.y).map(|(&x, &y)| view.place(x, y)), &style)
    }

    /// The caption below the scene, from `top` on, and its height.
    fn words(&self, outline: &Outline, width: f64, top: f64) -> (String, f64) {
        let start_x = self.path.first().map(|[_, x, _]| *x);
        let caption = self.caption;
        let mut y = top + 14.0;
        let mut out =
            text([FRAME, y], 18.0, "start", &format!("fill=\"{INK}\" font-weight=\"bold\""), &caption.title(outline));
        // A letter is about 0.55 of its size wide.
        let letters = (width / (0.55 * SMALL)) as usize;
        let reason = broken(caption.reason().unwrap_or_default(), letters);
        // Before the end the reason is not told, but has its room: all frames of an animation have one size.
        let reason = reason.into_iter().map(|line| if caption.at_end { line } else { String::new() });
        let parameters = broken(&caption.parameters(), letters);
        let mut lines: Vec<(String, &str)> = reason.chain(parameters).map(|line| (line, INK)).collect();
        lines.extend(caption.instant(outline, start_x).map(|line| (line, PALE_INK)));
        y += 6.0;
        for (line, colour) in lines {
            y += 20.0;
            out += &text([FRAME, y], SMALL, "start", &format!("fill=\"{colour}\""), &line);
        }
        (out, y + 14.0 - top)
    }
}

/// The text in lines of at most `letters` letters, broken at spaces; a longer word has a line of its own.
fn broken(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|word| !word.is_empty()) {
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
