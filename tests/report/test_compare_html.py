# SPDX-License-Identifier: BSD-3-Clause
"""The page of a comparison."""

from skidyn.report import render_comparison, summarize_comparison


def two_logs(fakes):
    second = fakes.make_diagnosis(n_samples=1500)
    second.findings = second.findings[:1]
    return fakes.make_diagnosis(), second


def test_markup_in_names_is_escaped(fakes):
    first, second = two_logs(fakes)
    page = render_comparison(summarize_comparison(first, second, names=(fakes.HOSTILE, "b")))
    assert "<img" not in page and page.count("</script>") == 3
