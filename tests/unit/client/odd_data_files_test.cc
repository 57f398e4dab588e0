// Reads odd data files: delimiters, encodings, numbers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/client/data_file_cases.h"

namespace polyest::internal {
namespace {

class OddFile : public ::testing::TestWithParam<ReadCase> {};

TEST_P(OddFile, IsReadRightly) {
  const ReadCase& file = GetParam();
  std::string found;
  EXPECT_EQ(Outcome(file.text, file.change, &found), file.values);
  EXPECT_EQ(found, file.found.empty() ? "" : "d.csv: " + file.found);
}

const ReadCase kDialectCases[] = {
    {"Plain", "t,x\n0,1.5\n1,2\n", "t=0,1 x=1.5,2", ""},
    {"SemicolonAndComma", "t;x\n0;1,5\n0,25;2\n", "t=0,0.25 x=1.5,2",
     "semicolons, decimal comma; 2 rows from 0 s"},
    {"SemicolonAndPoint", "t;x\n0;1.5\n1;2\n", "t=0,1 x=1.5,2", "semicolons; 2 rows from 0 s"},
    {"SemicolonThreeDecimals", "t;x\n12,345;1,234\n12,355;2,000\n", "t=12.345,12.355 x=1.234,2",
     "semicolons, decimal comma; 2 rows from 12.345 s"},
    {"WholeNumbersBeforeTheFirstComma", "t;x\n0;1\n1;2\n2;3,5\n", "t=0,1,2 x=1,2,3.5",
     "semicolons, decimal comma; 3 rows from 0 s"},
    {"Tabs", "t\tx\n0\t1.5\n", "t=0 x=1.5", "tabs; 1 row from 0 s"},
    {"TabsAndComma", "t\tx\n0,5\t1,25\n", "t=0.5 x=1.25", "tabs, decimal comma; 1 row from 0.5 s"},
    {"Bars", "t|x\n0|1.5\n", "t=0 x=1.5", "vertical bars; 1 row from 0 s"},
    {"QuotedCommas", "t,x\n\"0,5\",\"1,25\"\n", "t=0.5 x=1.25", "decimal comma; 1 row from 0.5 s"},
    {"QuotedCommasBesideWholeNumbers", "t,x,F\n\"0,5\",1,3\n\"1,5\",2,4\n", "t=0.5,1.5 x=1,2 F=3,4",
     "decimal comma; 2 rows from 0.5 s"},
    {"DelimiterByOption", "t;x\n0;1\n", "t=0 x=1", "semicolons; 1 row from 0 s", Delimiter(';')},
    {"Utf8WithMark", "\xEF\xBB\xBFt,x\n0,1\n", "t=0 x=1", ""},
    {"Utf16LittleWithMark", Utf16("t,x\n0,1.5\n1,2\n", false, true), "t=0,1 x=1.5,2",
     "UTF-16; 2 rows from 0 s"},
    {"Utf16BigWithMark", Utf16("t,x\r\n0,1.5\r\n", true, true), "t=0 x=1.5",
     "UTF-16; 1 row from 0 s"},
    {"Utf16LittleWithoutMark", Utf16("t,x\n0,1.5\n", false, false), "t=0 x=1.5",
     "UTF-16; 1 row from 0 s"},
    {"Utf16BigWithoutMark", Utf16("t,x\n0,1.5\n", true, false), "t=0 x=1.5",
     "UTF-16; 1 row from 0 s"},
    {"Latin1",
     "t;x;T [\xB0"
     "C]\n0;1;20\n",
     "t=0 x=1", "semicolons, Windows-1252; 1 column ignored ('T [°C]'); 1 row from 0 s"},
    {"QuotedHeaders", "\"t\",\"x\",\"a \"\"b\"\", c\"\n0,1,2\n", "t=0 x=1",
     "1 column ignored ('a \"b\", c'); 1 row from 0 s"},
    {"HeaderWithLineEnd", "t;\"x\n[mm]\"\n0;1500\n", "t=0 x=1.5",
     "semicolons; 'x [mm]' → x, mm → m; 1 row from 0 s"},
    {"QuotedCellsWithDelimiter", "t,note,x\n0,\"a, \"\"b\"\"\",1\n", "t=0 x=1",
     "1 column ignored ('note'); 1 row from 0 s"},
    {"Comments", "# rig 7\n\nt,x\n# begins\n0,1\n#end\n1,2\n", "t=0,1 x=1,2", ""},
    {"HeaderInComment", "# t,x\n0,1\n1,2\n", "t=0,1 x=1,2",
     "the header is a comment; 2 rows from 0 s"},
    {"LinesAboveTheHeader", "Rig;7\nDate;2026-01-31\nt;x\n0;1\n", "t=0 x=1",
     "semicolons; 2 lines above the header left out; 1 row from 0 s"},
    {"RowsWithoutIgnoredCells", "t,x,Comment\n0,1\n1,2,b\n", "t=0,1 x=1,2",
     "1 column ignored ('Comment'); 2 rows from 0 s"},
    {"SeparatorLine", "sep=;\nt;x\n0;1,5\n", "t=0 x=1.5",
     "semicolons, decimal comma; 1 line above the header left out; 1 row from 0 s"},
    {"BlankLines", "\n\nt,x\n\n0,1\n \n1,2\n\n", "t=0,1 x=1,2", ""},
    {"CarriageReturnsAndFeeds", "t,x\r\n0,1\r\n1,2\r\n", "t=0,1 x=1,2", ""},
    {"CarriageReturnsOnly", "t,x\r0,1\r1,2\r", "t=0,1 x=1,2", ""},
    {"MixedLineEnds", "t,x\r\n0,1\n1,2\r2,3", "t=0,1,2 x=1,2,3", ""},
    {"TrailingDelimiters", "t;x;\n0;1;\n1;2;\n", "t=0,1 x=1,2", "semicolons; 2 rows from 0 s"},
    {"TrailingDelimitersInRowsOnly", "t;x\n0;1;;\n1;2;\n", "t=0,1 x=1,2",
     "semicolons; 2 rows from 0 s"},
    {"TrailingDelimiterInHeaderOnly", "t;x;\n0;1\n", "t=0 x=1", "semicolons; 1 row from 0 s"},
};
INSTANTIATE_TEST_SUITE_P(Dialects, OddFile, ::testing::ValuesIn(kDialectCases),
                         [](const auto& i) { return i.param.name; });

const ReadCase kNumberCases[] = {
    {"GroupsWithPoints", "t;x\n0;1.234,5\n1;-1.234.567\n", "t=0,1 x=1234.5,-1.23457e+06",
     "semicolons, decimal comma; 2 rows from 0 s"},
    {"GroupsWithCommas", "t;x\n0;1,234.5\n1;2.5\n", "t=0,1 x=1234.5,2.5",
     "semicolons; 2 rows from 0 s"},
    {"GroupsWithApostrophes", "t,x\n0,1'234.5\n", "t=0 x=1234.5", ""},
    {"GroupsWithSpaces",
     "t;x\n0;1\xC2\xA0"
     "234,5\n1;1\xE2\x80\xAF"
     "000,25\n",
     "t=0,1 x=1234.5,1000.25", "semicolons, decimal comma; 2 rows from 0 s"},
    {"GroupsByOption", "t;x\n0;1.234\n", "t=0 x=1234", "semicolons, decimal comma; 1 row from 0 s",
     DecimalComma},
    {"GroupsWithCommasByOption", "t\tx\n0\t1,234\n", "t=0 x=1234", "tabs; 1 row from 0 s",
     DecimalPoint},
    {"PlusExponentAndBlanks", "t,x\n0, 1 \n1,+2\n2,1e5\n3,-1E-2\n4,.5\n5,6.\n",
     "t=0,1,2,3,4,5 x=1,2,100000,-0.01,0.5,6", ""},
    {"UnicodeMinus",
     "t,x\n0,\xE2\x88\x92"
     "1.5\n",
     "t=0 x=-1.5", ""},
    {"NoBreakSpaceAround",
     "t,x\n0,\xC2\xA0"
     "1.5\xC2\xA0\n",
     "t=0 x=1.5", ""},
    {"MissingWords", "t,x\n0,1\n1,NaN\n2,NA\n3,#N/A\n4,-\n5,\n6,n/a\n7,#NV\n8,null\n",
     "t=0,1,2,3,4,5,6,7,8 x=1,-,-,-,-,-,-,-,-",
     "7 cells such as 'NaN' taken for missing samples; 9 rows from 0 s"},
    {"MissingInTheFirstColumn", "x,t\n#N/A,0\n1,1\n", "t=0,1 x=-,1",
     "1 cell such as '#N/A' taken for missing samples; 2 rows from 0 s"},
    {"EmptyCells", "t,x,F\n0,,\n1,2,3\n", "t=0,1 x=-,2 F=-,3", ""},
    {"Runs", "run,x,t\n0,1,0\n0,2,1\n1,3,0\n", "t=0,1,0 run=0,0,1 x=1,2,3", ""},
    {"NoLastLineEnd", "t,x\n0,1\n1,2", "t=0,1 x=1,2", ""},
};
INSTANTIATE_TEST_SUITE_P(Numbers, OddFile, ::testing::ValuesIn(kNumberCases),
                         [](const auto& i) { return i.param.name; });

}  // namespace
}  // namespace polyest::internal
