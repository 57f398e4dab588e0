// Tests which FMUs of a folder are offered, and which are refused.

#include "core/fmu/fmu_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <zip.h>

#include <fstream>

#include "core/common/check.h"
#include "core/fmu/archive.h"
#include "core/fmu/fmu_description.h"
#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class FmuFolder : public testing::Test {
 protected:
  FmuFolder() {
    std::string folder = testing::TempDir() + "polyest-folder-XXXXXX";
    folder_ = mkdtemp(folder.data());
  }
  ~FmuFolder() override { std::filesystem::remove_all(folder_); }

  void Copy(const std::string& fmu, const std::string& as) {
    std::filesystem::copy_file(std::filesystem::path(POLYEST_TEST_FMUS) / (fmu + ".fmu"),
                               folder_ / (as + ".fmu"),
                               std::filesystem::copy_options::overwrite_existing);
  }
  // Makes an archive with these entries, the last a symbolic link if asked.
  std::filesystem::path Zip(const std::string& name,
                            const std::vector<std::pair<std::string, std::string>>& entries,
                            bool link = false) {
    const std::filesystem::path path = folder_ / (name + ".fmu");
    zip_t* const archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
    zip_int64_t index = 0;
    for (const auto& [entry, text] : entries) {
      index = zip_file_add(archive, entry.c_str(),
                           zip_source_buffer(archive, text.data(), text.size(), 0), 0);
    }
    if (link) {
      zip_file_set_external_attributes(archive, static_cast<zip_uint64_t>(index), 0, ZIP_OPSYS_UNIX,
                                       (S_IFLNK | 0777u) << 16);
    }
    EXPECT_EQ(zip_close(archive), 0);
    return path;
  }
  ModelFolder Open() { return *ModelFolder::Open(folder_, FmuFiles()); }
  std::string Reason(const std::string& name) {
    return std::string(Open().Find(name).status().message());
  }

  std::filesystem::path folder_;
};

std::vector<std::string> Names(const std::vector<Quantity>& quantities) {
  std::vector<std::string> names;
  for (const Quantity& quantity : quantities) names.push_back(quantity.name);
  return names;
}

TEST_F(FmuFolder, ShowsWhatAnFmuHas) {
  for (const char* name : {"oscillator_me2", "oscillator_me3", "oscillator_cs2"}) {
    SCOPED_TRACE(name);
    const std::shared_ptr<const Model> fmu = *TestFmus().Find(name);
    const ModelDescription& model = fmu->description();
    EXPECT_EQ(model.name, name);
    EXPECT_EQ(model.summary, "A mass on a spring and damper");
    EXPECT_THAT(Names(model.states), ElementsAre("x", "v"));
    EXPECT_THAT(Names(model.parameters), ElementsAre("m", "c", "k", "x0", "v0"));
    EXPECT_THAT(Names(model.inputs), ElementsAre("force"));
    EXPECT_THAT(Names(model.outputs), ElementsAre("x", "v", "a"));
    const Quantity& mass = model.parameters[0];
    EXPECT_EQ(mass.unit, "kg");  // from its declared type
    EXPECT_EQ(mass.meaning, "mass");
    EXPECT_EQ(mass.default_value, 0.1);
    EXPECT_EQ(model.parameters[1].unit, "N.s/m");
    EXPECT_THAT(model.source, HasSubstr("exported with the tests"));
  }
}

TEST_F(FmuFolder, SaysWhatKindAnFmuIsAndWhatOfItIsNotSettable) {
  const ModelFolder fmus = TestFmus();
  EXPECT_THAT(
      (*fmus.Find("oscillator_me2"))->description().equations,
      AllOf(HasSubstr("FMI 2.0 Model Exchange"), HasSubstr("keep their start values: steps")));
  EXPECT_THAT((*fmus.Find("oscillator_cs3"))->description().equations,
              AllOf(HasSubstr("FMI 3.0 Co-Simulation"), HasSubstr("at most 0.001 s"),
                    HasSubstr("keep their start values: table")));
}

TEST_F(FmuFolder, OffersAStateAsOutput) {
  EXPECT_THAT(Names((*TestFmus().Find("switch_me3"))->description().outputs), ElementsAre("x"));
}

TEST_F(FmuFolder, ListsItsNamesForOneItDoesNotHave) {
  Copy("oscillator_me2", "one");
  Copy("oscillator_me3", "two");
  const absl::Status status = Open().Find("three").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(status.message(), "there is no FMU \"three\"; there are one, two");
}

TEST_F(FmuFolder, RefusesNamesThatLeaveIt) {
  Copy("oscillator_me2", "one");
  for (const char* name : {"../one", "/one", "", ".", "..", "a/../one", "one\n", "\xff"}) {
    EXPECT_EQ(Open().Find(name).status().code(), absl::StatusCode::kInvalidArgument) << name;
  }
}

TEST_F(FmuFolder, SeesFilesThatComeChangeAndGo) {
  const ModelFolder fmus = Open();
  EXPECT_THAT(fmus.Models(), IsEmpty());
  Copy("oscillator_me2", "one");
  ASSERT_THAT(fmus.Models(), SizeIs(1));
  const std::shared_ptr<const Model> before = *fmus.Find("one");
  EXPECT_EQ(*fmus.Find("one"), before);
  Copy("ball_me2", "one");
  EXPECT_THAT(Names((*fmus.Find("one"))->description().outputs), ElementsAre("h", "v"));
  std::filesystem::remove(folder_ / "one.fmu");
  EXPECT_THAT(fmus.Models(), IsEmpty());
}

// A model that was compiled anew has the same description.
TEST_F(FmuFolder, TellsFilesOfOneDescriptionApart) {
  const ModelFolder fmus = Open();
  Copy("oscillator_me2", "one");
  Copy("oscillator_me2", "two");
  zip_t* const archive = zip_open((folder_ / "two.fmu").c_str(), 0, nullptr);
  zip_file_add(archive, "resources/table.txt", zip_source_buffer(archive, "1 2", 3, 0), 0);
  ASSERT_EQ(zip_close(archive), 0);
  const auto identity = [&](const char* name) {
    return (*fmus.Find(name))->description().identity;
  };
  EXPECT_NE(identity("one"), identity("two"));
  Copy("oscillator_me2", "two");
  EXPECT_EQ(identity("one"), identity("two"));
}

TEST_F(FmuFolder, MayLackAnFmuForATime) {
  Copy("oscillator_me2", "rig");
  FmuEnsemble ensemble(*Open().Find("rig"), 1, {"x"});
  std::filesystem::resize_file(folder_ / "rig.fmu", 100);
  const absl::Status half_copied = ensemble.TryPropagate({1}).status();
  EXPECT_EQ(half_copied.code(), absl::StatusCode::kUnavailable) << half_copied;
  std::filesystem::remove(folder_ / "rig.fmu");
  const absl::Status removed = ensemble.TryPropagate({1}).status();
  EXPECT_EQ(removed.code(), absl::StatusCode::kUnavailable) << removed;
  EXPECT_EQ(removed.message().substr(0, 9), "fmu rig: ");
  Copy("oscillator_me2", "rig");
  EXPECT_TRUE(ensemble.TryPropagate({1}).ok());
}

TEST_F(FmuFolder, ReportsABrokenFileAndServesTheOthers) {
  Copy("oscillator_me2", "good");
  std::ofstream(folder_ / "bad.fmu") << "not a zip archive";
  const ModelFolder fmus = Open();
  EXPECT_THAT(fmus.Models(), SizeIs(1));
  ASSERT_THAT(fmus.Broken(), SizeIs(1));
  EXPECT_EQ(fmus.Broken()[0].name, "bad");
  EXPECT_THAT(fmus.Find("bad").status().message(), HasSubstr("fmu bad: the file cannot be opened"));
}

TEST_F(FmuFolder, MustBeThere) {
  EXPECT_EQ(ModelFolder::Open(folder_ / "nowhere", FmuFiles()).status().code(),
            absl::StatusCode::kNotFound);
}

TEST_F(FmuFolder, RefusesArchivesThatWouldWriteElsewhere) {
  for (const char* entry : {"../evil", "a/../../evil", "/evil", "a\\..\\evil"}) {
    Zip("evil", {{"modelDescription.xml", "<x/>"}, {entry, "text"}});
    EXPECT_THAT(Reason("evil"), HasSubstr("the archive's entry")) << entry;
  }
  Zip("link", {{"modelDescription.xml", "<x/>"}, {"binaries", "/etc"}}, /*link=*/true);
  EXPECT_THAT(Reason("link"), HasSubstr("must not be a symbolic link"));
}

TEST_F(FmuFolder, RefusesArchivesThatAreTooLarge) {
  const std::filesystem::path file =
      Zip("large", {{"a", std::string(6000, 'a')}, {"b", std::string(6000, 'b')}});
  const absl::StatusOr<Archive> archive = Archive::Open(file, {.max_bytes = 10'000});
  ASSERT_TRUE(archive.ok());
  EXPECT_THAT(archive->Unpack(folder_).message(), HasSubstr("more than the limit of 10000 bytes"));
  EXPECT_THAT(archive->Read("a", 5999).status().message(), HasSubstr("more than 5999 bytes"));
  EXPECT_FALSE(Archive::Open(file, {.max_entries = 1}).ok());
}

std::string Xml(const std::string& root, const std::string& body) {
  return "<fmiModelDescription " + root + ">" + body + "</fmiModelDescription>";
}

TEST_F(FmuFolder, SaysWhatIsWrongWithADescription) {
  const std::string kind = "<ModelExchange modelIdentifier=\"m\"/>";
  const std::string version = "fmiVersion=\"2.0\" guid=\"g\" modelName=\"m\"";
  const std::string variable =
      "<ScalarVariable name=\"x\" valueReference=\"0\"><Real/></ScalarVariable>";
  const std::vector<std::pair<std::string, const char*>> wrong = {
      {"<fmiModel", "at byte"},
      {"<other/>", "the root must be fmiModelDescription"},
      {Xml("fmiVersion=\"1.0\"", kind), "fmiVersion \"1.0\" is not supported"},
      {Xml(version, ""), "neither Model Exchange nor Co-Simulation"},
      {Xml(version, "<CoSimulation modelIdentifier=\"../m\"/>"), "must be a C identifier"},
      {Xml(version, "<CoSimulation modelIdentifier=\"m\" needsExecutionTool=\"true\"/>"),
       "needs the tool"},
      {Xml(version, kind + "<ModelVariables>" + variable + variable + "</ModelVariables>"),
       "the variable x is there twice"},
      {Xml(version, kind + "<ModelStructure><Derivatives><Unknown index=\"7\"/></Derivatives>"
                           "</ModelStructure>"),
       "there is no variable 7"},
      {Xml(version, kind + "<ModelVariables>" + variable +
                        "</ModelVariables><ModelStructure><Derivatives><Unknown index=\"1\"/>"
                        "</Derivatives></ModelStructure>"),
       "must be the derivative of a single real variable"},
      {Xml(version, kind + "<ModelVariables><ScalarVariable name=\"x\" valueReference=\"0\">"
                           "<Real start=\"one\"/></ScalarVariable></ModelVariables>"),
       "the start value \"one\" of x must be a finite number"},
      {Xml(version, kind + "<DefaultExperiment stepSize=\"-1\"/>"), "stepSize \"-1\""},
      {Xml(version, kind), "the archive has no binaries/linux64/m.so: export it for 64-bit Linux"},
  };
  for (const auto& [xml, reason] : wrong) {
    Zip("wrong", {{"modelDescription.xml", xml}});
    EXPECT_THAT(Reason("wrong"), HasSubstr(reason)) << xml;
  }
  Zip("wrong", {{"readme.txt", "nothing"}});
  EXPECT_THAT(Reason("wrong"), HasSubstr("the archive has no modelDescription.xml"));
}

TEST_F(FmuFolder, TakesFloat32AndStartValuesOfStates) {
  const absl::StatusOr<FmuDescription> fmu = ParseFmuDescription(
      "m", Xml("fmiVersion=\"3.0\" instantiationToken=\"t\" modelName=\"m\"",
               "<ModelExchange modelIdentifier=\"m\"/><ModelVariables>"
               "<Float32 name=\"p\" valueReference=\"1\" causality=\"parameter\" start=\"2.5\"/>"
               "<Float64 name=\"x\" valueReference=\"2\" initial=\"exact\" start=\"3\"/>"
               "<Float64 name=\"dx\" valueReference=\"3\" derivative=\"2\"/>"
               "<Int32 name=\"i\" valueReference=\"4\" causality=\"parameter\" start=\"1\"/>"
               "</ModelVariables><ModelStructure><ContinuousStateDerivative valueReference=\"3\"/>"
               "</ModelStructure>"));
  ASSERT_TRUE(fmu.ok()) << fmu.status();
  EXPECT_THAT(Names(fmu->model.parameters), ElementsAre("p", "x"));
  EXPECT_TRUE(fmu->parameters[0].is_float32);
  EXPECT_EQ(fmu->model.parameters[1].default_value, 3);
  EXPECT_THAT(Names(fmu->model.states), ElementsAre("x"));
  EXPECT_THAT(Names(fmu->model.outputs), ElementsAre("x"));
  EXPECT_THAT(fmu->model.equations, HasSubstr("keep their start values: i"));
}

// Returns whether an FMU's derivatives may depend on the time. `time` declares it, `dependencies`
// is an attribute of the only derivative.
bool UsesTime2(const std::string& time, const std::string& dependencies) {
  const absl::StatusOr<FmuDescription> fmu = ParseFmuDescription(
      "m", Xml("fmiVersion=\"2.0\" guid=\"t\" modelName=\"m\"",
               "<ModelExchange modelIdentifier=\"m\"/><ModelVariables>"
               "<ScalarVariable name=\"x\" valueReference=\"7\"><Real/></ScalarVariable>"
               "<ScalarVariable name=\"dx\" valueReference=\"8\"><Real derivative=\"1\"/>"
               "</ScalarVariable>" +
                   time + "</ModelVariables><ModelStructure><Derivatives><Unknown index=\"2\"" +
                   dependencies + "/></Derivatives></ModelStructure>"));
  POLYEST_CHECK(fmu.ok());
  return fmu->interface.derivatives_use_time;
}
bool UsesTime3(const std::string& time, const std::string& dependencies) {
  const absl::StatusOr<FmuDescription> fmu = ParseFmuDescription(
      "m", Xml("fmiVersion=\"3.0\" instantiationToken=\"t\" modelName=\"m\"",
               "<ModelExchange modelIdentifier=\"m\"/><ModelVariables>"
               "<Float64 name=\"x\" valueReference=\"7\"/>"
               "<Float64 name=\"dx\" valueReference=\"8\" derivative=\"7\"/>" +
                   time +
                   "</ModelVariables><ModelStructure><ContinuousStateDerivative "
                   "valueReference=\"8\"" +
                   dependencies + "/></ModelStructure>"));
  POLYEST_CHECK(fmu.ok());
  return fmu->interface.derivatives_use_time;
}

TEST_F(FmuFolder, SaysWhetherDerivativesMayDependOnTheTime) {
  const std::string time2 =
      "<ScalarVariable name=\"t\" valueReference=\"9\" causality=\"independent\"><Real/>"
      "</ScalarVariable>";  // the third variable
  EXPECT_FALSE(UsesTime2(time2, " dependencies=\"1\""));
  EXPECT_FALSE(UsesTime2(time2, " dependencies=\"\""));
  EXPECT_TRUE(UsesTime2(time2, " dependencies=\"1 3\""));
  EXPECT_TRUE(UsesTime2(time2, ""));
  EXPECT_TRUE(UsesTime2(time2, " dependencies=\"x\""));
  EXPECT_TRUE(UsesTime2("", " dependencies=\"1\""));
  const std::string time3 = "<Float64 name=\"t\" valueReference=\"9\" causality=\"independent\"/>";
  EXPECT_FALSE(UsesTime3(time3, " dependencies=\"7\""));
  EXPECT_FALSE(UsesTime3(time3, " dependencies=\"\""));
  EXPECT_TRUE(UsesTime3(time3, " dependencies=\"7\n9\""));
  EXPECT_TRUE(UsesTime3(time3, ""));
  EXPECT_TRUE(UsesTime3("", " dependencies=\"7\""));
}

}  // namespace
}  // namespace polyest::internal
