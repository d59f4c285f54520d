#include "base/csv.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace upswing {
namespace {

TEST(Csv, WantedColumnsInTheOrderOfTheirNames) {
  const auto columns = ReadCsv("# made by hand\na, b ,note,c\n\n1,2,x,3\n# half\n-4,5e1,,0.5\n",
                               {"c", "b"}, "t.csv");
  ASSERT_EQ(columns.size(), 2U);
  EXPECT_EQ(columns[0].name, "c");
  EXPECT_EQ(columns[0].values, (std::vector<double>{3, 0.5}));
  EXPECT_EQ(columns[1].values, (std::vector<double>{2, 50}));
  EXPECT_TRUE(ReadCsv("", {"a"}, "t.csv").front().values.empty());
  EXPECT_TRUE(ReadCsv("a\n", {"a"}, "t.csv").front().values.empty());
}

TEST(Csv, AsSpreadsheetsAndLibrariesWriteIt) {
  const auto values = [](std::string_view text) {
    return ReadCsv(text, {"torque"}, "t.csv").front().values;
  };
  EXPECT_EQ(values("\xef\xbb\xbftorque\r\n1\r\n2\r\n"), (std::vector<double>{1, 2}));
  EXPECT_EQ(values("\xef\xbb\xbf\"torque\",\"t\"\n\"1.5\",\"0\"\n"), (std::vector<double>{1.5}));
  EXPECT_EQ(values("\"a, \"\"b\"\"\" , \"torque\"\n\"x,\"\"y,\",2\n,3\n"),
            (std::vector<double>{2, 3}));
  EXPECT_EQ(ReadCsv("\"a \"\"b\"\"\"\n4\n", {"a \"b\""}, "t.csv").front().values,
            (std::vector<double>{4}));
}

TEST(Csv, SeparatorsDecimalCommasAndComments) {
  const auto values = [](std::string_view text) {
    return ReadCsv(text, {"b", "a"}, "t.csv").front().values;
  };
  const std::vector<double> expected{1.5, -2e-3};
  EXPECT_EQ(values("a,b\n0,1.5\n0,-2e-3\n"), expected);
  EXPECT_EQ(values("sep=;\r\na;b\r\n0;1,5\r\n0;-2e-3\r\n"), expected);
  EXPECT_EQ(values("% logger\n// v2\n; of today\na\tb\n0\t1,5\n# half\n0\t-2,0e-3\n"), expected);
  EXPECT_EQ(values("a;\"b\"\n0;\"1,5\"\n0;-0.002"), expected);
  EXPECT_EQ(CsvNames("sep=\t\na\tb,c\n", "t.csv"), (std::vector<std::string>{"a", "b,c"}));
  EXPECT_EQ(values("sep=|\na|b\n0|1,5\n0|-2e-3\n"), expected);
  EXPECT_EQ(values("sep=;\n;b;a\n0;1,5;0\n1;-2e-3;0\n"), expected);  // the index has no name
  EXPECT_EQ(values("a  b\n 0   1.5\n 0  -2e-3\n"), expected);
  EXPECT_EQ(values("# by numpy\n# a b\n0 1.5\n# half\n0 -2e-3\n"), expected);
  EXPECT_EQ(values("% a,b\n0,1.5\n0,-2e-3\n"), expected);
}

TEST(Csv, NamesOfTheColumns) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(CsvNames("\xef\xbb\xbf# by hand\r\n\n \"a\", b\r\n1,2\n", "t.csv"), (Names{"a", "b"}));
  EXPECT_EQ(CsvNames("a,,b", "t.csv"), (Names{"a", "", "b"}));
  EXPECT_EQ(CsvNames("\n# only a comment", "t.csv"), Names());
  EXPECT_EQ(CsvNames("", "t.csv"), Names());
  EXPECT_THROW(CsvNames("\"a,b\n", "t.csv"), Error);
}

/// The error message of ReadCsv when it reads column b of a text.
std::string Complaint(std::string_view text) {
  try {
    ReadCsv(text, {"b"}, "t.csv");
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2);
    return error.what();
  }
  return "none";
}

TEST(Csv, MessagesNameLineAndColumn) {
  EXPECT_EQ(Complaint("a,c\n1,2\n"), "t.csv:1: expected a column \"b\", got \"a\" in \"a,c\"");
  EXPECT_EQ(Complaint("a,b\n1,2\n3\n"), "t.csv:3: expected 2 columns, got 1");
  EXPECT_EQ(Complaint("a,b\n1,2\n3"),
            "t.csv:3: expected 2 columns, got 1: the last line is cut off; remove it");
  EXPECT_EQ(Complaint("a,b\n1,2,5\n"), "t.csv:2: expected 2 columns, got 3");
  EXPECT_EQ(Complaint("a;b\n1;2,5,1\n"),
            "t.csv:2: b: expected a finite number, got \"2,5,1\": remove separators of thousands");
  EXPECT_EQ(Complaint("\xff\xfe"
                      "a"),
            "t.csv: expected text in UTF-8, got UTF-16: save it as UTF-8");
  EXPECT_EQ(Complaint("a,b\n# c\n1,x\n"),
            "t.csv:3: b: expected a finite number, got \"x\": if the line has units or a summary, "
            "put # before it");
  EXPECT_EQ(Complaint(std::string("a,b\n1,2\0003\n", 10)),
            "t.csv: expected a CSV text, got binary data: export it as CSV");
  EXPECT_EQ(
      Complaint("a,b\n1,inf\n"),
      "t.csv:2: b: expected a finite number, got \"inf\": a missing value; remove or fill its row");
  EXPECT_EQ(Complaint("a,b\nx,1\n"), "none");
  EXPECT_EQ(Complaint("##\n1,2\n"),
            "t.csv:2: expected a column \"b\", got \"1,2\": the first line needs the names");
  EXPECT_EQ(Complaint("a,b\n\"x,1\n"), "t.csv:2: expected a closing quote, got \"\"x,1\"");
  EXPECT_EQ(
      Complaint("a,b\n1,\"\"\n"),
      "t.csv:2: b: expected a finite number, got \"\": a missing value; remove or fill its row");
}

TEST(Csv, RefusesMoreColumnsThanAnyTableHas) {
  EXPECT_EQ(Complaint("b" + std::string(4095, ',') + "\n1" + std::string(4095, ',')), "none");
  const std::string wide = std::string(4096, ',');
  EXPECT_EQ(Complaint("b" + wide), "t.csv:1: expected at most 4096 columns, got more");
  EXPECT_EQ(Complaint("b\n1" + wide), "t.csv:2: expected at most 4096 columns, got more");
  EXPECT_THROW(CsvNames(wide, "t.csv"), Error);
}

TEST(Csv, NamesOfATableAreEscapedAsItsTextsAre) {
  CsvTable table;
  table.Add("a, \"b\"\nforged", 1);
  table.Add("\x1b[2J", 2);
  table.EndRow();
  EXPECT_EQ(table.text(), "\"a, \"\"b\"\"\\nforged\",\\x1b[2J\n1,2\n");
  EXPECT_EQ(CsvNames(table.text(), "t.csv"),
            (std::vector<std::string>{"a, \"b\"\\nforged", "\\x1b[2J"}));
}

TEST(Csv, NoCellOfATableIsAFormula) {
  CsvTable table;
  for (const char* text : {"=1+1", "+a", "-a", "@SUM(1)", " =1", "x;=1", "x; -y", "-0.5", "-inf",
                           "a=1", "a-b", "=a,b"}) {
    table.Add("c", text);
  }
  table.Add("=name", 1);
  table.EndRow();
  EXPECT_EQ(table.text(),
            "c,c,c,c,c,c,c,c,c,c,c,c,'=name\n"
            "'=1+1,'+a,'-a,'@SUM(1), '=1,x;'=1,x; '-y,-0.5,-inf,a=1,a-b,\"'=a,b\",1\n");
}

TEST(Csv, ATableHasTheNamesOfItsFirstRowAndQuotesWhereNecessary) {
  CsvTable table;
  for (const int64_t row : {int64_t{1}, int64_t{9'000'000'000'000'000}}) {
    table.Add("a", row);
    table.Add("empty", "");
    table.Add("text", "x,\"y\"");
    table.Add("lines", "1\n2\u20283");
    table.Add("c", 0.1);
    table.EndRow();
  }
  EXPECT_EQ(table.text(),
            "a,empty,text,lines,c\n1,,\"x,\"\"y\"\"\",1\\n2\\u20283,0.1\n"
            "9000000000000000,,\"x,\"\"y\"\"\",1\\n2\\u20283,0.1\n");
}

}  // namespace
}  // namespace upswing
