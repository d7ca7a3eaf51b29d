"""The style sheet of the report: one column of text, quiet tables, light and dark, wide screen and phone."""

STYLE = """
:root { --paper: #f6f7f9; --card: #ffffff; --ink: #1f2933; --muted: #5f6b7a; --line: #dfe4ea; --accent: #0072b2;
  --warn: #fff4e5; --warn-line: #d98a1f; }
@media (prefers-color-scheme: dark) { :root { --paper: #12161b; --card: #1b2128; --ink: #e6eaef; --muted: #9aa7b5;
  --line: #303944; --accent: #56b4e9; --warn: #2d2517; --warn-line: #c98a35; } }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; background: var(--paper); color: var(--ink); line-height: 1.55;
  font-family: system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; font-size: 16px; }
main { max-width: 68rem; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
header { margin-bottom: 1.75rem; }
h1 { font-size: clamp(1.7rem, 4.5vw, 2.4rem); line-height: 1.15; letter-spacing: -0.02em; margin: 0 0 0.5rem; }
h2 { font-size: 1.35rem; letter-spacing: -0.01em; margin: 2.75rem 0 0.75rem; }
h3 { font-size: 1rem; margin: 0 0 0.6rem; }
figcaption { max-width: 50rem; }
p { max-width: 50rem; margin: 0.5rem 0 1rem; }
.lead { font-size: 1.12rem; }
.muted, figcaption, small, dt { color: var(--muted); }
.tiles { list-style: none; display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: 0.8rem;
  padding: 0; margin: 1.5rem 0; }
.tiles li, figure, .wide, .pairs, details { background: var(--card); border: 1px solid var(--line);
  border-radius: 12px; }
.tiles li { padding: 0.9rem 1.1rem; display: flex; flex-direction: column; }
.tiles strong { font-size: 1.9rem; line-height: 1.2; letter-spacing: -0.02em; color: var(--accent);
  font-variant-numeric: tabular-nums; }
.tiles small { font-size: 0.82rem; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; width: 100%; font-size: 0.88rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.55rem 0.62rem; text-align: right; white-space: nowrap; }
th:first-child { padding-left: 1.1rem; }
th:last-child, td:last-child { padding-right: 1.1rem; }
th:first-child { text-align: left; }
thead th { color: var(--muted); font-weight: 600; font-size: 0.8rem; white-space: normal; vertical-align: bottom;
  border-bottom: 1px solid var(--line); }
tbody th { font-weight: 600; }
tbody tr + tr td, tbody tr + tr th { border-top: 1px solid var(--line); }
tr.bound th, tr.bound td { color: var(--muted); font-weight: 400; }
tbody tr.first-bound th, tbody tr.first-bound td { border-top: 2px solid var(--muted); }
figure { margin: 1rem 0; padding: 1.1rem 1.2rem 1.2rem; }
figure img { display: block; width: 100%; height: auto; background: #ffffff; border-radius: 8px; margin: 0 auto; }
figure.narrow img { max-width: 36rem; }
figure.small img { max-width: 26rem; }
figcaption { font-size: 0.9rem; margin-top: 0.7rem; }
.pan { overflow-x: auto; }
@media (max-width: 40rem) { figure.full img { width: 44rem; max-width: none; } }
.pairs { display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 0.1rem 1.5rem;
  margin: 1rem 0; padding: 0.9rem 1.2rem; }
.pairs div { min-width: 0; padding: 0.3rem 0; }
dt { font-size: 0.8rem; }
dd { margin: 0; overflow-wrap: anywhere; font-variant-numeric: tabular-nums; }
details { padding: 0.8rem 1.2rem; margin: 1rem 0; }
details .pairs, details .wide { border: 0; padding-left: 0; padding-right: 0; margin: 0.4rem 0; }
summary { cursor: pointer; font-weight: 600; }
.notice { background: var(--warn); border-left: 4px solid var(--warn-line); border-radius: 6px; margin: 1rem 0;
  padding: 0.7rem 1rem 0.7rem 2rem; }
footer { margin-top: 3rem; border-top: 1px solid var(--line); padding-top: 1rem; font-size: 0.85rem; }
@media print { body { background: #ffffff; } figure, .tiles li { break-inside: avoid; } }
"""
