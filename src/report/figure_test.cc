#include "report/figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/error.h"
#include "os/file.h"
#include "os/testing.h"
#include "report/layout.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

// Each of these characters is special in gnuplot, a shell or XML.
const std::string kHostile = R"(it's "q" $HOME `ls` a_b^2 {/Bold x} \alpha 100% @m ~ & <b> ω₁)";
// XML allows a bare >.
const std::string kHostileXml =
    R"(it's "q" $HOME `ls` a_b^2 {/Bold x} \alpha 100% @m ~ &amp; &lt;b> ω₁)";

Line Curve(const std::string& name) { return {name, {0, 1, 2}, {1, 3, 2}, {0, 2, 1}, {2, 4, 3}}; }

/// A figure with a panel of curves above a panel with a heat map.
Figure Example() {
  Figure figure;
  figure.title = "the figure's title";
  Panel curves{"curves", "time (s)", "return", {Curve("first"), Curve("second")}, {}, {}, {}};
  curves.lines[1].points = true;
  Panel map{"map", "mass (kg)", "length (m)", {}, {}, {}, {}};
  map.heat_map = {{1, 2, 3}, {1, 2}, {0, 1, 2, 3, NAN, 5}, "success", 0, 5};
  map.lines.push_back({"plant of training", {2}, {1}, {}, {}, true});
  figure.panels = {curves, map};
  return figure;
}

class FigureTest : public ::testing::Test {
 protected:
  std::string Svg(const Figure& figure) {
    Draw(figure, folder_ / "a.svg");
    return ReadOwnFile(folder_ / "a.svg");
  }
  TempFolder folder_;
};

/// Whether all tags are closed in order, as XML requires, and there is one root.
bool WellFormed(const std::string& xml) {
  std::vector<std::string> open;
  int roots = 0;
  for (size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at + 1)) {
    const bool comment = xml.compare(at, 4, "<!--") == 0;
    const size_t end = comment ? xml.find("-->", at) : xml.find('>', at);
    if (end == std::string::npos) return false;
    if (comment || xml[at + 1] == '?' || xml[at + 1] == '!') {
      at = end;
      continue;
    }
    const bool closing = xml[at + 1] == '/';
    const size_t begin = at + (closing ? 2 : 1);
    const std::string name = xml.substr(begin, xml.find_first_of(" \t\n/>", begin) - begin);
    if (closing) {
      if (open.empty() || open.back() != name) return false;
      open.pop_back();
    } else if (xml[end - 1] != '/') {
      roots += open.empty() ? 1 : 0;
      open.push_back(name);
    }
    at = end;
  }
  return open.empty() && roots == 1;
}

TEST_F(FigureTest, SvgIsWellFormedAndHasEveryText) {
  EXPECT_FALSE(WellFormed("<svg><g></svg></g>"));
  EXPECT_FALSE(WellFormed("<svg>"));
  const std::string svg = Svg(Example());
  EXPECT_TRUE(WellFormed(svg));
  EXPECT_NE(svg.find("width=\"900\" height=\"600\""), std::string::npos);
  for (const char* text : {"the figure's title", "curves", "time (s)", "return", "first", "second",
                           "map", "mass (kg)", "length (m)", "success", "plant of training"}) {
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(FigureTest, CellsHaveTheColoursOfTheirNumbers) {
  const auto count = [](const std::string& svg, const std::string& color) {
    size_t n = 0;
    for (size_t at = svg.find(color); at != std::string::npos; at = svg.find(color, at + 1)) ++n;
    return n;
  };
  // Both ends of viridis appear in the colour bar once, and in each cell with that number.
  const std::string low = "rgb( 68,   1,  84)";
  const std::string high = "rgb(253, 231,  37)";
  Figure figure = Example();
  const std::string one = Svg(figure);
  figure.panels[1].heat_map->z = {0, 0, 0, 5, NAN, 5};
  const std::string more = Svg(figure);
  EXPECT_GE(count(one, low), 1);
  EXPECT_EQ(count(more, low), count(one, low) + 2);
  EXPECT_EQ(count(more, high), count(one, high) + 1);
  // An empty cell has no polygon. A number in that cell adds one.
  figure.panels[1].heat_map->z = {0, 0, 0, 5, 5, 5};
  EXPECT_EQ(count(Svg(figure), "<polygon"), count(more, "<polygon") + 1);
}

TEST_F(FigureTest, PngHasSignatureAndSize) {
  Figure figure = Example();
  figure.width = 640;
  figure.height = 480;
  Draw(figure, folder_ / "a.png");
  const std::string png = ReadOwnFile(folder_ / "a.png");
  // PNG specification, 5.2 and 11.2.2: signature, then the header with width and height.
  ASSERT_GT(png.size(), 24U);
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(png.substr(12, 4), "IHDR");
  EXPECT_EQ(png.substr(16, 8), std::string("\0\0\x02\x80\0\0\x01\xe0", 8));
}

TEST_F(FigureTest, TextsAreDrawnLiterally) {
  Figure figure = Example();
  figure.title = kHostile + "1";
  figure.panels[0].title = kHostile + "2";
  figure.panels[0].x_label = kHostile + "3\nsystem 'touch bad'";
  figure.panels[0].y_label = kHostile + "4\xff\x1b\u0085\uffff";
  figure.panels[0].lines[0].name = kHostile + "5";
  figure.panels[1].heat_map->label = kHostile + "6";
  const std::string svg = Svg(figure);
  EXPECT_TRUE(WellFormed(svg));
  for (const char* number : {"1", "2", R"(3\nsystem)", R"(4\xff\x1b\u0085\uffff)", "5", "6"}) {
    EXPECT_NE(svg.find(kHostileXml + number), std::string::npos) << number;
  }
  EXPECT_FALSE(fs::exists("bad"));
}

TEST_F(FigureTest, NaNLeavesAGap) {
  // Count moves: each piece of the curve begins with a move.
  const auto pieces = [&](double middle) {
    Figure figure;
    figure.panels.resize(1);
    figure.panels[0].lines = {{"", {0, 1, 2, 3, 4}, {0, 1, middle, 3, 4}, {}, {}}};
    const std::string svg = Svg(figure);
    return std::ranges::count(svg, 'M');
  };
  EXPECT_EQ(pieces(NAN), pieces(2) + 1);
}

TEST_F(FigureTest, ACaptionTakesAsManyLinesAsItNeedsAndATitleIsCut) {
  Figure figure = Example();
  const std::vector<Box> before = Layout(figure);
  for (int i = 0; i < 40; ++i) figure.caption += "settings ä " + std::to_string(i) + "; ";
  const std::vector<std::string> lines = CaptionLines(figure);
  ASSERT_GE(lines.size(), 3U);
  EXPECT_EQ(lines.front().find("settings ä 0; settings ä 1;"), 0U);
  const std::vector<Box> after = Layout(figure);
  EXPECT_NEAR(before[0].top - after[0].top, static_cast<double>(lines.size()) * kCaptionLine + 6,
              1e-9);
  figure.title = std::string(300, 'x') + "ω/policy.safetensors";
  const std::string title = FittedTitle(figure);
  EXPECT_LT(title.size(), 120U);
  EXPECT_EQ(title.find("…x"), 0U);
  EXPECT_TRUE(title.ends_with("xω/policy.safetensors"));
  const std::string svg = Svg(figure);
  EXPECT_TRUE(WellFormed(svg));
  EXPECT_NE(svg.find("settings ä 39;"), std::string::npos);
  EXPECT_NE(svg.find("policy.safetensors"), std::string::npos);
}

TEST_F(FigureTest, ALineIsDottedFromWhereItSays) {
  Figure figure;
  figure.panels.resize(1);
  figure.panels[0].lines = {{"", {0, 1, 2, 3, 4}, {0, 1, 2, 3, 4}, {}, {}}};
  EXPECT_EQ(Svg(figure).find("stroke-dasharray"), std::string::npos);
  figure.panels[0].lines[0].dotted_from = 2;
  EXPECT_NE(Svg(figure).find("stroke-dasharray"), std::string::npos);
}

TEST_F(FigureTest, PanelsAreAligned) {
  Figure figure = Example();
  figure.panels.push_back({"", "", "", {}, {}, {}, {}});
  figure.columns = 2;
  const std::vector<Box> boxes = Layout(figure);
  ASSERT_EQ(boxes.size(), 3U);
  for (const Box& box : boxes) {
    EXPECT_NEAR(box.right - box.left, boxes[0].right - boxes[0].left, 1e-9);
    EXPECT_NEAR(box.top - box.bottom, boxes[0].top - boxes[0].bottom, 1e-9);
    EXPECT_GT(box.bottom, 0);
    EXPECT_LT(box.right, figure.width);
  }
  EXPECT_EQ(boxes[0].top, boxes[1].top);
  EXPECT_EQ(boxes[0].left, boxes[2].left);
  EXPECT_GT(boxes[1].left, boxes[0].right);
  EXPECT_GT(boxes[0].bottom, boxes[2].top);
}

TEST_F(FigureTest, PanelsWithoutNumbersAreDrawn) {
  Figure figure;
  figure.panels.resize(3);
  figure.panels[1].lines = {{"nothing", {}, {}, {}, {}}, {"not a number", {NAN}, {NAN}, {}, {}}};
  figure.panels[2].heat_map = {{1}, {1}, {NAN}, "empty", 0, 0};
  EXPECT_TRUE(WellFormed(Svg(figure)));
}

TEST_F(FigureTest, AnotherEndingIsBadInputAndWritesNothing) {
  for (const char* name : {"a.jpg", "a", "svg", "a.svg.gz"}) {
    try {
      Draw(Example(), folder_ / name);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      EXPECT_NE(std::string(error.what()).find("expected a name that ends with .svg or .png"),
                std::string::npos);
    }
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

/// The message of the Failure when Draw runs with PATH = `path`. Checks that the old file stays.
std::string FailureWithPath(const std::string& path, const fs::path& file) {
  WriteFileAtomically(file, "old");
  const std::string before = getenv("PATH");
  setenv("PATH", path.c_str(), 1);
  std::string message = "none";
  try {
    Draw(Example(), file);
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 1);
    message = error.what();
  }
  setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(ReadOwnFile(file), "old");
  return message;
}

TEST_F(FigureTest, WithoutGnuplotTheMessageNamesThePackage) {
  const std::string message = FailureWithPath(folder_.path().string(), folder_ / "a.svg");
  EXPECT_NE(message.find("Debian's package gnuplot-nox"), std::string::npos) << message;
}

TEST_F(FigureTest, AnErrorOfGnuplotIsReportedOnOneLine) {
  WriteFileAtomically(
      folder_ / "gnuplot",
      "#!/bin/sh\nprintf '\\nplot x\\n     ^\\n\"/dev/stdin\" line 7: the reason\\n\\n' >&2\n"
      "exit 1\n");
  fs::permissions(folder_ / "gnuplot", fs::perms::owner_all);
  EXPECT_EQ(FailureWithPath(folder_.path().string(), folder_ / "a.svg"),
            "figure: gnuplot failed: the reason");
}

TEST_F(FigureTest, TooSmallAFigureIsRefused) {
  Figure tiny = Example();
  tiny.width = 100;
  EXPECT_THROW(Draw(tiny, folder_ / "a.svg"), Error);
}

}  // namespace
}  // namespace upswing
