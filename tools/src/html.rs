//! The frame that all pages of the project share: it follows the reader's light or dark setting and fits a phone.

use pulldown_cmark::{Options, Parser, html::push_html};

/// Colours, type and tables.
const STYLE: &str = "
:root { color-scheme: light dark; --ink: #1b2733; --soft: #5b6b7a; --paper: #ffffff; --panel: #f4f6f8; --rule: #d7dee5; --accent: #0b63b6; --good: #1f7a4d; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root:not([data-theme=light]) { --ink: #e6ebf0; --soft: #9aa8b5; --paper: #14191f; --panel: #1d242c; --rule: #34404b; --accent: #6cb4ff; --good: #5fc792; --bad: #ff8a80; } }
:root[data-theme=light] { color-scheme: light; }
:root[data-theme=dark] { color-scheme: dark; --ink: #e6ebf0; --soft: #9aa8b5; --paper: #14191f; --panel: #1d242c; --rule: #34404b; --accent: #6cb4ff; --good: #5fc792; --bad: #ff8a80; }
html { scroll-padding-top: 1rem; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 62rem; padding: 1.5rem 1rem 4rem; font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper); }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; }
h3 { font-size: 1.05rem; margin: 1.6rem 0 .4rem; }
p, li { max-width: 46rem; }
a { color: var(--accent); }
.lead, .note { color: var(--soft); }
.note { font-size: .9rem; }
.wide { overflow-x: auto; }
.wide td:first-child, .wide th:first-child { position: sticky; left: 0; background: var(--paper); }
.wide td:first-child:not(.number) { min-width: 6.5rem; }
table { border-collapse: collapse; font-size: .92rem; }
th, td { text-align: left; vertical-align: top; padding: .35rem .8rem .35rem 0; border-bottom: 1px solid var(--rule); }
th { color: var(--soft); font-weight: 600; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; }
td.number { white-space: nowrap; }
code { font: .92em ui-monospace, monospace; }
pre { background: var(--panel); border-radius: 6px; padding: .8rem 1rem; overflow-x: auto; }
.what { min-width: 15rem; }
.good { color: var(--good); white-space: nowrap; }
.bad { color: var(--bad); white-space: nowrap; }
.plot { width: 100%; height: 24rem; margin: .5rem 0 1rem; }
h2 a { color: inherit; text-decoration: none; }
nav { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem; padding: .7rem 0; border-bottom: 1px solid var(--rule); font-size: .95rem; }
.tabs { display: flex; flex-wrap: wrap; gap: .4rem; margin: 1rem 0; }
.tabs button, #theme { font: inherit; color: var(--ink); background: var(--panel); border: 1px solid var(--rule); border-radius: 6px; padding: .3rem .8rem; cursor: pointer; }
.tabs button[aria-selected=true] { border-color: var(--accent); color: var(--accent); }
#theme { position: fixed; right: .8rem; top: .8rem; z-index: 2; padding: .2rem .6rem; }
@media (max-width: 40rem) { body { padding: 1rem .7rem 3rem; } h1 { padding-right: 2.5rem; } .plot { height: 27rem; } td, th { padding-right: .5rem; } .wide td:not(.number) { min-width: 6rem; } }
@media print { #theme, nav, .tabs button:not([aria-selected=true]), .modebar { display: none; } .plot, tr { break-inside: avoid; } h2, h3, .note { break-after: avoid; } }
";

/// A whole document; `head` holds scripts, `body` is markup.
pub fn document(title: &str, head: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>{STYLE}</style>\n{head}</head>\n<body>\n{body}</body>\n</html>\n"
    )
}

/// Text as markup that shows this text.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Markdown as markup; wide tables scroll by themselves.
pub fn markdown(text: &str) -> String {
    let mut markup = String::new();
    push_html(&mut markup, Parser::new_ext(text, Options::ENABLE_TABLES));
    markup.replace("<table>", "<div class=\"wide\"><table>").replace("</table>", "</table></div>")
}

/// A table; the columns marked as numbers are set to the right. Cells are markup.
pub fn table(head: &[(&str, bool)], rows: &[Vec<String>]) -> String {
    let class = |column: usize| match head.get(column) {
        Some((_, true)) => " class=\"number\"",
        _ => "",
    };
    let mut markup = String::from("<div class=\"wide\"><table>\n<tr>");
    for (column, (name, _)) in head.iter().enumerate() {
        markup.push_str(&format!("<th{}>{}</th>", class(column), escape(name)));
    }
    markup.push_str("</tr>\n");
    for row in rows {
        markup.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            markup.push_str(&format!("<td{}>{cell}</td>", class(column)));
        }
        markup.push_str("</tr>\n");
    }
    markup.push_str("</table></div>\n");
    markup
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escape("<a href=\"x\"> & co"), "&lt;a href=&quot;x&quot;&gt; &amp; co");
    }

    #[test]
    fn only_number_columns_are_set_to_the_right() {
        let markup = table(&[("name", false), ("value", true)], &[vec!["m".into(), "1575".into()]]);
        assert!(markup.contains("<td>m</td><td class=\"number\">1575</td>"), "{markup}");
    }
}
