from benchmarks.page import PAGE, filled


def test_the_page_shows_the_committed_figures():
    text = PAGE.read_text(encoding="utf-8")
    assert filled(text) == text
