// Reads data files with columns, units and times as rigs name and write them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/client/data_file_cases.h"

namespace polyest::internal {
namespace {

class OddColumns : public ::testing::TestWithParam<ReadCase> {};

TEST_P(OddColumns, IsReadRightly) {
  const ReadCase& file = GetParam();
  std::string found;
  EXPECT_EQ(Outcome(file.text, file.change, &found), file.values);
  EXPECT_EQ(found, file.found.empty() ? "" : "d.csv: " + file.found);
}

const ReadCase kColumnCases[] = {
    {"TimeElsewhere", "x,t\n1,0\n", "t=0 x=1", ""},
    {"GermanTime", "Zeit [s];x\n0;1\n", "t=0 x=1", "semicolons; 'Zeit [s]' is t; 1 row from 0 s"},
    {"TimeInMilliseconds", "Time (ms),x\n12,1\n24,2\n", "t=0.012,0.024 x=1,2",
     "'Time (ms)' is t, ms → s; 2 rows from 0.012 s"},
    {"TimeEnding", "t_ms,x\n12,1\n", "t=0.012 x=1", "'t_ms' is t, ms → s; 1 row from 0.012 s"},
    {"TimeByOption", "clock,time,x\n0,7,1\n", "t=0 x=1",
     "'clock' is t; 1 column ignored ('time'); 1 row from 0 s", TimeColumn("clock")},
    {"TimeBySource", "Lauf,x\n250,1\n", "t=0.25 x=1", "'Lauf' is t, ms → s; 1 row from 0.25 s",
     From("t", "Lauf", "ms")},
    {"ExactTimeBeforeUsualNames", "time,t,x\n7,0,1\n", "t=0 x=1",
     "1 column ignored ('time'); 1 row from 0 s"},
    {"TemperatureIsNoTime", "Zeit [s],x,T [°C]\n0,1,20\n", "t=0 x=1",
     "'Zeit [s]' is t; 1 column ignored ('T [°C]'); 1 row from 0 s"},
    {"TimeIsNotInUnitsOfOthers", "time,x,tempo [km/h]\n0,1,20\n", "t=0 x=1",
     "'time' is t; 1 column ignored ('tempo [km/h]'); 1 row from 0 s"},
    {"TimeOfDayHasNoUnit", "Zeit [hh:mm:ss],x\n00:00:01,1\n", "t=1 x=1",
     "'Zeit [hh:mm:ss]' is t; 1 row from 1 s"},
    {"UnitInBrackets", "t,x [mm]\n0,12\n", "t=0 x=0.012", "'x [mm]' → x, mm → m; 1 row from 0 s"},
    {"UnitInParentheses", "t,F (kN)\n0,1.5\n", "t=0 F=1500",
     "'F (kN)' → F, kN → N; 1 row from 0 s"},
    {"UnitBehindSlash", "t / s,x / mm\n0,12\n", "t=0 x=0.012",
     "'t / s' is t; 'x / mm' → x, mm → m; 1 row from 0 s"},
    {"UnitBehindSlashWithoutSpaces", "t/ms,x/mm\n50,12\n", "t=0.05 x=0.012",
     "'t/ms' is t, ms → s; 'x/mm' → x, mm → m; 1 row from 0.05 s"},
    {"UnitBehindIn", "Zeit in ms,x in mm\n0,12\n", "t=0 x=0.012",
     "'Zeit in ms' is t, ms → s; 'x in mm' → x, mm → m; 1 row from 0 s"},
    {"FractionInParenthesesBehindSlash", "t / (s),v / (m/s),w / (U/min)\n0,12,60\n",
     "t=0 v=12 w=6.28319",
     "'t / (s)' is t; 'v / (m/s)' → v; 'w / (U/min)' → w, U/min → rad/s; 1 row from 0 s",
     [](DataColumns& c) {
       c.measured = {"v", "w"};
       c.units = {{"v", "m/s"}, {"w", "rad/s"}};
     }},
    {"FractionInBracketsBehindSlash", "t,x / [1/min]\n0,60\n", "t=0 x=6.28319",
     "'x / [1/min]' → x, 1/min → rad/s; 1 row from 0 s",
     [](DataColumns& c) { c.units["x"] = "rad/s"; }},
    {"NestedParenthesesBehindSlash", "t,x / (J/(kg K))\n0,3\n", "t=0 x=3",
     "'x / (J/(kg K))' → x; 1 row from 0 s", [](DataColumns& c) { c.units["x"] = "J/(kg K)"; }},
    {"SameUnit", "t,x [m]\n0,12\n", "t=0 x=12", "'x [m]' → x; 1 row from 0 s"},
    {"UnitsRow", "t;x;F\ns;mm;kN\n0;12;1\n", "t=0 x=0.012 F=1000",
     "semicolons; units in line 2; 'x', mm → m; 'F', kN → N; 1 row from 0 s"},
    {"UnitsRowInBrackets", "t,x,F\n[ms],[mm],[-]\n5,12,1\n", "t=0.005 x=0.012 F=1",
     "units in line 2; 't' is t, ms → s; 'x', mm → m; 1 row from 0.005 s",
     [](DataColumns& c) { c.units["F"] = "1"; }},
    {"UnitOfSource", "t,Disp\n0,12\n", "t=0 x=0.012", "'Disp' → x, mm → m; 1 row from 0 s",
     From("x", "Disp", "mm")},
    {"SourceOverridesTheHeader", "t,x [V]\n0,12\n", "t=0 x=0.012",
     "'x [V]' → x, mm → m; 1 row from 0 s", From("x", "", "mm")},
    {"WholeHeaderAsSource", "t,Disp [mm],Disp [in]\n0,12,1\n", "t=0 x=0.0254",
     "'Disp [in]' → x, in → m; 1 column ignored ('Disp [mm]'); 1 row from 0 s",
     From("x", "Disp [in]")},
    {"ModelWithoutUnit", "t,x [mm]\n0,12\n", "t=0 x=12",
     "'x [mm]' → x in mm, not converted; 1 row from 0 s", [](DataColumns& c) { c.units.clear(); }},
    {"GravityWhereTheModelHasAnAcceleration", "t,x [g]\n0,2\n", "t=0 x=19.6133",
     "'x [g]' → x, g → m/s^2; 1 row from 0 s", [](DataColumns& c) { c.units["x"] = "m/s^2"; }},
    {"Degrees", "t,x [°]\n0,180\n", "t=0 x=3.14159", "'x [°]' → x, ° → rad; 1 row from 0 s",
     [](DataColumns& c) { c.units["x"] = "rad"; }},
    {"UnreadableUnitOfAnIgnoredColumn", "t,x,T [quux]\n0,1,2\n", "t=0 x=1",
     "1 column ignored ('T [quux]'); 1 row from 0 s"},
    {"UnitAsEnding", "t,x_mm,F_kN\n0,12,1\n", "t=0 x=0.012 F=1000",
     "'x_mm' → x, mm → m; 'F_kN' → F, kN → N; 1 row from 0 s"},
    {"NameBeforeNameWithEnding", "t,x,x_mm\n0,1,2\n", "t=0 x=1",
     "1 column ignored ('x_mm'); 1 row from 0 s"},
    {"EndingThatIsAnotherQuantity", "t,x_m,F\n0,1,2\n", "t=0 x_m=1",
     "1 column ignored ('F'); 1 row from 0 s",
     [](DataColumns& c) {
       c.measured = {"x", "x_m"};
     }},
    {"EndingThatIsMapped", "t,x_mm\n0,12\n", "t=0 F=12", "'x_mm' → F; 1 row from 0 s",
     From("F", "x_mm")},
    {"EndingOfAnotherDimension", "t,F,x_kg\n0,1,2\n", "t=0 F=1",
     "1 column ignored ('x_kg'); 1 row from 0 s"},
    {"PowerWithoutASign", "t,x [m/s2]\n0,2\n", "t=0 x=2", "'x [m/s2]' → x; 1 row from 0 s",
     [](DataColumns& c) { c.units["x"] = "m/s^2"; }},
    {"Inches", "t,x (inch)\n0,2\n", "t=0 x=0.0508", "'x (inch)' → x, inch → m; 1 row from 0 s"},
    {"Celsius", "t,x [°C]\n0,20\n", "t=0 x=293.15", "'x [°C]' → x, °C → K; 1 row from 0 s",
     [](DataColumns& c) { c.units["x"] = "K"; }},
    {"GroupByName", "t,SUSP.x\n0,1\n", "t=0 x=1", "'SUSP.x' → x; 1 row from 0 s",
     From("x", "SUSP.x")},
    {"NumberedChannelsAreNoSlip", "t,pos1,pos3\n0,1,2\n", "t=0 pos1=1",
     "1 column ignored ('pos3'); 1 row from 0 s",
     [](DataColumns& c) {
       c.measured = {"pos1", "pos2"};
     }},
};
INSTANTIATE_TEST_SUITE_P(Columns, OddColumns, ::testing::ValuesIn(kColumnCases),
                         [](const auto& i) { return i.param.name; });

const ReadCase kTimeCases[] = {
    {"FirstRowIsZero", "t,x\n12.5,1\n12.75,2\n", "t=0,0.25 x=1,2", "2 rows, t = 0 at 12.5",
     TimeFirst},
    {"FirstRowOfEachRunIsZero", "t,run,x\n5,0,1\n6,0,2\n100,1,3\n101,1,4\n",
     "t=0,1,0,1 run=0,0,1,1 x=1,2,3,4", "4 rows, t = 0 at 5", TimeFirst},
    {"NegativeTimesFromTheFirstRow", "t,x\n-1,1\n1,2\n", "t=0,2 x=1,2", "2 rows, t = 0 at -1",
     TimeFirst},
    {"IsoTimes", "time,x\n2026-01-31T23:59:59.5Z,1\n2026-02-01T00:00:00.250Z,2\n", "t=0,0.75 x=1,2",
     "'time' is t; 2 rows, t = 0 at 2026-01-31T23:59:59.5Z"},
    {"IsoTimesWithBlankAndComma", "time;x\n2026-01-31 10:00:00,5;1\n2026-01-31 10:00:01,75;2\n",
     "t=0,1.25 x=1,2", "semicolons; 'time' is t; 2 rows, t = 0 at 2026-01-31 10:00:00,5"},
    {"IsoTimesWithZones", "time,x\n2026-01-31T10:00:00+01:00,1\n2026-01-31T09:00:02Z,2\n",
     "t=0,2 x=1,2", "'time' is t; 2 rows, t = 0 at 2026-01-31T10:00:00+01:00"},
    {"GermanDates", "Datum/Zeit;x\n31.01.2026 23:59:59,999;1,5\n01.02.2026 00:00:00,001;2\n",
     "t=0,0.002 x=1.5,2",
     "semicolons, decimal comma; 'Datum/Zeit' is t; 2 rows, t = 0 at 31.01.2026 23:59:59,999"},
    {"DayFirst", "time,x\n01/02/2026 10:00:00,1\n02/02/2026 10:00:00,2\n", "t=0,86400 x=1,2",
     "'time' is t; 2 rows, t = 0 at 01/02/2026 10:00:00", DayFirst},
    {"MonthFirst", "time,x\n01/02/2026 11:00:00 AM,1\n02/02/2026 11:00:00 PM,2\n",
     "t=0,2.7216e+06 x=1,2", "'time' is t; 2 rows, t = 0 at 01/02/2026 11:00:00 AM", MonthFirst},
    {"ADayThatIsNoMonth", "time,x\n31/01/2026 10:00:00,1\n01/02/2026 10:00:00,2\n",
     "t=0,86400 x=1,2", "'time' is t; 2 rows, t = 0 at 31/01/2026 10:00:00"},
    {"ADayThatIsNoMonthFirst", "time,x\n01/31/2026 11:59:58.5 PM,1\n02/01/2026 12:00:00 AM,2\n",
     "t=0,1.5 x=1,2", "'time' is t; 2 rows, t = 0 at 01/31/2026 11:59:58.5 PM"},
    {"TimesOfDay", "time,x\n00:00:01.5,1\n00:01:00,2\n", "t=1.5,60 x=1,2",
     "'time' is t; 2 rows from 1.5 s"},
    {"UnitOfATimeOfDay", "Zeit [hh:mm:ss],x\n10:00:00,1\n", "t=36000 x=1",
     "'Zeit [hh:mm:ss]' is t; 1 row from 36000 s"},
};
INSTANTIATE_TEST_SUITE_P(Times, OddColumns, ::testing::ValuesIn(kTimeCases),
                         [](const auto& i) { return i.param.name; });

}  // namespace
}  // namespace polyest::internal
