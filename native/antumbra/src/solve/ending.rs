//! How a solution ended, for the report.

use crate::display::{Display, Light};
use crate::report::ResultSummary;
use crate::settings::Transport;
use crate::solve::Solver;

impl Solver<'_> {
    /// Why it ended.
    pub(super) fn ended_by(&self) -> &'static str {
        if self.problem.monitor.wants_end() {
            "stopped"
        } else if self.course.ends()() {
            "time_limit"
        } else if self.out_of_budget && self.problem.settings.triangle_budget == 0 {
            "refinement_limit"
        } else if self.out_of_budget {
            "triangle_budget"
        } else {
            "converged"
        }
    }

    /// Where light was not looked for, and what was held back.
    pub(super) fn warnings(&self, display: &Display, result: &ResultSummary) -> Vec<String> {
        let mut warnings = Vec::new();
        let shown = if self.transport_mode == Transport::Rays {
            "they show what their patches get, without finer shadows"
        } else {
            "they show none of it"
        };
        for (light, name) in [(Light::Direct, "light of emitters"), (Light::Indirect, "indirect light")] {
            let share = display.guessed(light);
            if share > 0.0 {
                warnings.push(format!(
                    "it ended before the {name} was looked for at {:.0} % of the vertices: {shown}",
                    (100.0 * share).max(1.0)
                ));
            }
        }
        if self.out_of_budget && self.problem.settings.triangle_budget == 0 {
            warnings.push(format!(
                "the mesh was not refined beyond {} triangles: set triangle_budget for a finer one, or a larger tolerance",
                result.triangles
            ));
        }
        warnings
    }
}
