//! A plan as a physicist reads it.

use crate::campaign::durations::written_s;
use crate::campaign::memory::size;
use crate::campaign::plan::{BlockPlan, Cost, Plan, Repeats, ShortTime, Switch};
use crate::parameters::{Integrator, Short, cut_to_three_digits};
use std::fmt::{self, Write};

impl Plan {
    pub(crate) fn cost(&self) -> Option<Cost> {
        self.blocks.iter().map(|block| block.cost).reduce(Cost::and)
    }

    /// The plan in words and numbers; wall times are for this many threads.
    pub fn render(&self, threads: usize) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = self.write(&mut text, threads);
        text
    }

    fn write(&self, out: &mut String, threads: usize) -> fmt::Result {
        writeln!(out, "campaign {}: {} jobs to run", self.campaign, self.jobs.len())?;
        for block in &self.blocks {
            writeln!(out)?;
            block.write(out, threads)?;
        }
        match self.cost() {
            Some(cost) if self.blocks.len() > 1 => {
                writeln!(out, "\nall blocks\n  cost     {}", CostText(cost, threads))
            }
            Some(_) | None => Ok(()),
        }
    }
}

impl BlockPlan {
    fn write(&self, out: &mut String, threads: usize) -> fmt::Result {
        let jobs = self.points as u64 * self.runs;
        writeln!(out, "{}", self.name)?;
        writeln!(
            out,
            "  model    {} in {}, {} points x {} runs = {jobs} jobs",
            self.model, self.scene, self.points, self.runs
        )?;
        writeln!(out, "  jobs     {}", self.counts_text())?;
        let (dt, limit) = (self.dt.cut(), self.dt_limit.cut());
        if self.integrators.iter().all(|chosen| chosen.integrator == Integrator::Adaptive.name()) {
            writeln!(out, "  dt       {dt} between two looks at the droplet")?;
        } else {
            writeln!(out, "  dt       {dt}; verlet is stable below {limit}, stiffest term {}", self.stiffest)?;
        }
        writeln!(out, "  limits   {}", self.ends_text())?;
        if let Some(short) = &self.short_time {
            writeln!(out, "  warning  {}", self.short_text(short))?;
        }
        if let Some(repeats) = &self.repeats {
            writeln!(out, "  warning  {}", self.repeats_text(repeats))?;
        }
        for chosen in &self.integrators {
            let at = match chosen.points {
                all if all == self.points => String::new(),
                some => format!("at {some} of {} points: ", self.points),
            };
            writeln!(out, "  {:<8} {at}{}", chosen.integrator, chosen.why)?;
        }
        for (label, on) in [("on", true), ("off", false)] {
            let effects = self.effects.iter().filter(|effect| effect.on == on);
            let texts: Vec<_> = effects.map(|effect| format!("{} ({})", effect.name, effect.why)).collect();
            writeln!(out, "  {label:<8} {}", texts.join(", "))?;
        }
        for Switch { name, places } in &self.switches {
            writeln!(out, "  switch   {name} = {places}")?;
        }
        if let Some(rounds) = &self.rounds {
            writeln!(out, "  rounds   {rounds}")?;
        }
        writeln!(out, "  memory   at most {} on each of {threads} threads", size(self.memory))?;
        writeln!(out, "  cost     {}", CostText(self.cost, threads))
    }

    fn repeats_text(&self, Repeats { points, way, box_size }: &Repeats) -> String {
        format!(
            "a droplet may go {} sigma{}, and meets the same obstacles again after box_size = {}: decay lengths count runs \
             as cut off there; give a larger box_size, or a distance below it",
            Short(cut_to_three_digits(*way)),
            self.at(*points),
            Short(*box_size)
        )
    }

    /// ` at 3 of 5 points`, or nothing if it is all of them.
    fn at(&self, points: usize) -> String {
        if points == self.points { String::new() } else { format!(" at {points} of {} points", self.points) }
    }

    fn short_text(&self, ShortTime { points, t_max, needed }: &ShortTime) -> String {
        let at = self.at(*points);
        format!(
            "t_max = {} is short{at}: to flow the whole way and then come to rest may take {} t0; a run that is cut off \
             before it rests does not count as a clog",
            Short(*t_max),
            Short(cut_to_three_digits(*needed))
        )
    }

    fn ends_text(&self) -> String {
        let text = |(name, ends): &(&str, Option<Ends>)| match ends {
            Some(ends) => format!("{name} = {ends}"),
            None => format!("{name} = none"),
        };
        self.ends.iter().map(text).collect::<Vec<_>>().join(", ")
    }

    fn counts_text(&self) -> String {
        let counts = &self.counts;
        let mut text =
            format!("{} new, {} pending, {} done, {} failed", counts.new, counts.pending, counts.done, counts.failed);
        let extras = [(counts.running, "running"), (counts.shared, "of an earlier block")];
        for (count, what) in extras.into_iter().filter(|(count, _)| *count > 0) {
            text += &format!(", {count} {what}");
        }
        text
    }
}

/// Smallest and largest of some numbers, written as `0.01 .. 10`, or as one number if they are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Ends {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        Self { low, high }
    }

    pub(super) fn cut(self) -> Self {
        Self { low: cut_to_three_digits(self.low), high: cut_to_three_digits(self.high) }
    }
}

impl fmt::Display for Ends {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.low == self.high {
            true => write!(f, "{}", Short(self.low)),
            false => write!(f, "{} .. {}", Short(self.low), Short(self.high)),
        }
    }
}

/// A cost in words; wall times are for this many threads.
struct CostText(Cost, usize);

impl fmt::Display for CostText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(cost, threads) = self;
        let Some(mean) = cost.mean_s() else { return write!(f, "nothing to run") };
        write!(
            f,
            "about {} of CPU, {} a job, {} on {threads} threads, by a guess of how far droplets get",
            written_s(cost.total_s),
            written_s(mean),
            written_s(cost.wall_s(*threads))
        )
    }
}
