//! A page of sections, text and charts. It follows the reader's light or dark setting, or the switch in its corner.

use plotly::Plot;

use super::Chart;
use crate::html::{document, escape, markdown};

/// Draws a chart when it comes into view, and again when the theme changes; adds its data as CSV to the tools of each chart.
const SCRIPT: &str = include_str!("page.js");

/// A page under construction.
pub(crate) struct Page {
    title: String,
    body: String,
    sections: Vec<(String, String)>,
    plots: String,
    tabs: usize,
}

impl Page {
    pub(crate) fn new(title: &str, lead: &str) -> Self {
        let body = format!("<p class=\"lead\">{}</p>\n", escape(lead));
        Self { title: title.to_owned(), body, sections: Vec::new(), plots: String::new(), tabs: 0 }
    }

    /// Begins a section that the contents link to.
    pub(crate) fn section(&mut self, id: &str, title: &str) {
        self.body.push_str(&format!("<h2 id=\"{id}\"><a href=\"#{id}\">{}</a></h2>\n", escape(title)));
        self.sections.push((id.to_owned(), title.to_owned()));
    }

    /// Text in Markdown.
    pub(crate) fn text(&mut self, text: &str) {
        self.body.push_str(&markdown(text));
    }

    /// Markup as it is.
    pub(crate) fn markup(&mut self, markup: &str) {
        self.body.push_str(markup);
    }

    /// A chart under a heading of its own.
    pub(crate) fn chart(&mut self, chart: &Chart) {
        let Chart { id, title, note, .. } = chart;
        self.body.push_str(&format!("<h3>{}</h3>\n", escape(title)));
        if !note.is_empty() {
            self.body.push_str(&format!("<p class=\"note\">{}</p>\n", escape(note)));
        }
        self.body.push_str(&format!("<div class=\"plot\" id=\"{id}\"></div>\n"));
        self.plots.push_str(&format!("\"{id}\": {},\n", chart.json()));
    }

    /// Panels of which one is seen at a time; each has a name and is filled by `fill`.
    pub(crate) fn tabs(&mut self, names: &[&str], mut fill: impl FnMut(&mut Self, usize)) {
        self.tabs += 1;
        let group = format!("tabs{}", self.tabs);
        self.body.push_str("<div class=\"tabs\" role=\"tablist\">\n");
        for (i, name) in names.iter().enumerate() {
            self.body.push_str(&format!(
                "<button role=\"tab\" aria-controls=\"{group}-{i}\" aria-selected=\"{}\">{}</button>\n",
                i == 0,
                escape(name)
            ));
        }
        self.body.push_str("</div>\n");
        for i in 0..names.len() {
            let hidden = if i == 0 { "" } else { " hidden" };
            self.body.push_str(&format!("<div class=\"panel\" role=\"tabpanel\" id=\"{group}-{i}\"{hidden}>\n"));
            fill(self, i);
            self.body.push_str("</div>\n");
        }
    }

    /// The whole document.
    pub(crate) fn finish(self) -> String {
        let mut top = format!("<h1>{}</h1>\n", escape(&self.title));
        if self.sections.len() > 1 {
            let links = self.sections.iter().map(|(id, title)| format!("<a href=\"#{id}\">{}</a>", escape(title)));
            top.push_str(&format!("<nav>{}</nav>\n", links.collect::<Vec<_>>().join("\n")));
        }
        let switch = "<button id=\"theme\" aria-label=\"light or dark\" title=\"light or dark\">\u{25d0}</button>\n";
        let script = format!("<script>\nconst plots = {{\n{}}};\n{SCRIPT}</script>\n", self.plots);
        document(&self.title, &library(), &format!("{switch}{top}{}{script}", self.body))
    }
}

/// A page with some markup above its charts.
pub(crate) fn assemble(title: &str, lead: &str, above: &str, charts: &[Chart]) -> String {
    let mut page = Page::new(title, lead);
    page.markup(above);
    for chart in charts {
        page.chart(chart);
    }
    page.finish()
}

/// The plotting library without the formula renderer that comes with it: the page shows no formulas and halves in size.
pub(super) fn library() -> String {
    let sources = Plot::offline_js_sources();
    let end = sources.find("</script>").map_or(sources.len(), |at| at + "</script>".len());
    sources[..end].to_owned() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plots::{BLUE, Curve, chart};

    #[test]
    fn sections_are_linked_and_the_first_tab_is_open() {
        let mut page = Page::new("Title", "lead");
        page.section("first", "One & only");
        page.section("second", "Two");
        page.tabs(&["left", "right"], |page, i| {
            let curve = Curve::new("curve", &[0.0, 1.0], vec![0.0, 1.0], BLUE);
            page.chart(&chart(["same", "chart", ""], ["x", "y"], vec![curve]).named(format!("chart-{i}")));
        });
        let page = page.finish().replace(&library(), "");
        assert!(page.contains("<a href=\"#first\">One &amp; only</a>"));
        assert!(page.contains("id=\"tabs1-0\">") && page.contains("id=\"tabs1-1\" hidden>"), "{page}");
        assert!(page.contains("\"chart-0\": {") && page.contains("id=\"chart-1\""));
    }
}
